"""A host for our WebAssembly modules, with the functions that a browser would give them."""

import ctypes
import math
from functools import cache
from typing import Any

import numpy as np
import wasmtime
from numba import carray, cfunc, types
from wasmtime import _bindings as c

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Riccati

# wasmtime hands a function one array of 16 bytes a value, for its arguments and its result.
CALLED = types.intp(types.voidptr, types.voidptr, types.CPointer(types.float64), types.uint64)
NO_FINALIZER = ctypes.cast(None, ctypes.CFUNCTYPE(None, ctypes.c_void_p))


@cache
def machine_code(name: str) -> Any:
    """A function of `math` that wasmtime can call without Python in between."""
    function, two = getattr(math, name), name == "pow"

    if two:

        def call(_env, _caller, values, _count):
            numbers = carray(values, 4)
            numbers[0] = function(numbers[0], numbers[2])
            return 0
    else:

        def call(_env, _caller, values, _count):
            numbers = carray(values, 2)
            numbers[0] = function(numbers[0])
            return 0

    return cfunc(CALLED)(call)


@cache
def compiled(data: bytes) -> tuple[wasmtime.Engine, wasmtime.Module]:
    """The module, compiled once for all its instances."""
    engine = wasmtime.Engine()
    return engine, wasmtime.Module(engine, data)


class Module:
    """An instance of a module; its functions are called by name, arrays are put and read."""

    def __init__(self, data: bytes) -> None:
        engine, module = compiled(data)
        self._store = wasmtime.Store(engine)
        self.imports = sorted(one.name for one in module.imports)
        given = [self._given(one.name, one.type) for one in module.imports]
        self._exports = wasmtime.Instance(self._store, module, given).exports(self._store)

    def __call__(self, name: str, *arguments: float) -> Any:
        """Call a function.

        Raises:
            MemoryError, ValueError, RuntimeError: the call was ended, and why.
        """
        try:
            return self._exports[name](self._store, *arguments)
        except wasmtime.Trap as error:
            why = self._exports["why"](self._store)
            raise {1: MemoryError, 2: ValueError}.get(why, RuntimeError)(why) from error

    def put(self, numbers: Any) -> int:
        """Reserve room for an array and write it there; its address."""
        array = np.ascontiguousarray(numbers, float)
        address = self("reserve", max(array.nbytes, 8))
        self.write(address, array)
        return address

    def write(self, address: int, numbers: Any) -> None:
        array = np.ascontiguousarray(numbers, float)
        ctypes.memmove(self._begin + address, array.ctypes.data, array.nbytes)

    def read(self, address: int, count: int) -> Vector:
        out = np.empty(count)
        ctypes.memmove(out.ctypes.data, self._begin + address, out.nbytes)
        return out

    @property
    def _begin(self) -> int:
        memory = self._exports["memory"].data_ptr(self._store)
        return ctypes.addressof(memory.contents)

    def _given(self, name: str, kind: wasmtime.FuncType) -> wasmtime.Func:
        function, code = c.wasmtime_func_t(), machine_code(name)
        callback = ctypes.cast(code.address, c.wasmtime_func_unchecked_callback_t)
        c.wasmtime_func_new_unchecked(
            self._store._context(), kind.ptr(), callback, None, NO_FINALIZER, ctypes.byref(function)
        )
        return wasmtime.Func._from_raw(function)


class Controller:
    """An `Nmpc` whose solves a module makes; solutions are (value, features, action, numbers)."""

    def __init__(self, module: Module, nmpc: Nmpc) -> None:
        self.module, self.nmpc = module, nmpc
        target, lower, upper, discs, sides, discount, *rest = Riccati().prepare(nmpc.ocp).problem
        self.horizon, self.discs = len(discount) - 1, len(discs)
        arrays = [module.put(each) for each in (target, lower, upper, discs, sides, discount)]
        self._target, self._discs = arrays[0], arrays[3]
        self._problem = (self.horizon, self.discs, len(sides), *arrays, *rest)
        n, m = nmpc.plant.n, nmpc.plant.m
        self._d = 2 * n + m + 1
        z = (self.horizon + 1) * (n + self.discs) + self.horizon * m
        lam = (self.horizon + 1) * (n + self.discs)
        self._sizes = [2 * z + lam + fixed * m + self._d for fixed in (0, 1)]
        rooms = (n, self._d, m, self._sizes[1], self._sizes[1], 5, n, self._d)
        self._at = [module.put(np.zeros(size)) for size in rooms]

    def solve(self, state, theta, warm_start=None, action=None):
        """As `Nmpc.solve`.

        Raises:
            ArithmeticError: no optimum was found; with the end.
        """
        n, m = self.nmpc.plant.n, self.nmpc.plant.m
        states, thetas, actions, old, out, report, *_ = self._at
        there = states, thetas, actions
        fixed = int(action is not None)
        for place, numbers in zip(there, (state, theta, action), strict=True):
            if numbers is not None:
                self.module.write(place, numbers)
        known = -1
        if warm_start is not None:
            known = int(warm_start["fixed"])
            self.module.write(old, warm_start["numbers"])
        arguments = (*self._problem, *there, fixed, known, old, 1e-8, out, report)
        end = self.module("nmpc_solve", *arguments)
        if end:
            raise ArithmeticError(end)
        value, iterations, restarts, violation, _ = self.module.read(report, 5)
        numbers = self.module.read(out, self._sizes[fixed])
        return {
            "value": value,
            "iterations": int(iterations),
            "restarts": int(restarts),
            "violation": violation,
            "fixed": fixed,
            "numbers": numbers,
            "action": numbers[n : n + m],
            "features": numbers[-self._d :],
        }

    def hessian_times(self, state, theta, solution, vector, action=None):
        """As `Nmpc.value_hessian_times`."""
        states, thetas, actions, old, _, _, _, out = self._at
        self.module.write(states, state)
        self.module.write(thetas, theta)
        self.module.write(actions, np.zeros(self.nmpc.plant.m) if action is None else action)
        self.module.write(old, solution["numbers"])
        w = self.module.put(vector)
        there = (states, thetas, actions, solution["fixed"], old, w, out)
        formed = self.module("nmpc_hessian_times", *self._problem, *there)
        self.module("release", w)
        return self.module.read(out, self._d) if formed else None

    def step(self, state, action):
        """As `Plant.step`."""
        states, _, actions, *_, later, _ = self._at
        self.module.write(states, state)
        self.module.write(actions, action)
        self.module("plant_step", states, actions, later)
        return self.module.read(later, self.nmpc.plant.n)

    def cost(self, state, action):
        """As `Task.stage_cost`."""
        states, _, actions, *_ = self._at
        self.module.write(states, state)
        self.module.write(actions, action)
        return self.module("stage_cost", self.discs, self._discs, self._target, states, actions)
