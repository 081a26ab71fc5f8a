"""A host for our WebAssembly modules, with the functions that a browser would give them."""

import ctypes
import math
import struct
from functools import cache
from typing import Any

import numpy as np
import wasmtime
from numba import carray, cfunc, types
from numpy.typing import NDArray
from wasmtime import _bindings as c

from nmpcrl import Vector
from nmpcrl.control import Nmpc, browser

# wasmtime hands a function one array of 16 bytes a value, for its arguments and its result.
CALLED = types.intp(types.voidptr, types.voidptr, types.CPointer(types.float64), types.uint64)
SIZE = 8  # bytes of a number
HEAD = 6  # numbers of a problem before its data, as `solvers.entries` has it
DOUBLES = ctypes.POINTER(ctypes.c_double)
NO_FINALIZER = ctypes.cast(None, ctypes.CFUNCTYPE(None, ctypes.c_void_p))


@cache
def machine_code(name: str) -> Any:
    """A function of `math` that wasmtime can call without Python in between."""
    function, two = getattr(math, name), name in ("atan2", "pow")

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


class Function:
    """A function of an instance: its numbers are packed and taken as one array, 16 bytes each."""

    def __init__(self, store: wasmtime.Store, function: wasmtime.Func) -> None:
        kind = function.type(store)
        self._given, self._found = layout(kind.params), layout(kind.results)
        self._values = (c.wasmtime_val_raw_t * max(len(kind.params), 1))()
        self._function, self._store = function, store  # neither may go before this does
        self._where = (store._context(), ctypes.byref(function._func), self._values)

    def __call__(self, *arguments: float) -> Any:
        """Its result, or None; the number of arguments is checked, their ranges are too.

        Raises:
            struct.error: there are too many arguments or too few, or one is none for its place.
            wasmtime.Trap: the call was ended.
        """
        self._given.pack_into(self._values, 0, *arguments)
        trap = ctypes.POINTER(c.wasm_trap_t)()
        error = c.wasmtime_func_call_unchecked(*self._where, len(self._values), ctypes.byref(trap))
        if error:
            raise wasmtime.WasmtimeError._from_ptr(error)
        if trap:
            raise wasmtime.Trap._from_ptr(trap)
        return next(iter(self._found.unpack_from(self._values)), None)


def layout(kinds: list[wasmtime.ValType]) -> struct.Struct:
    """How numbers of these types stand in an array."""
    return struct.Struct("<" + "".join({"i32": "i12x", "f64": "d8x"}[str(one)] for one in kinds))


class Module:
    """An instance of a module; its functions are called by name, arrays are put and read."""

    def __init__(self, data: bytes) -> None:
        engine, module = compiled(data)
        store = wasmtime.Store(engine)
        self.imports = sorted(one.name for one in module.imports)
        given = [self._given(store, one.name, one.type) for one in module.imports]
        exports = dict(wasmtime.Instance(store, module, given).exports(store))
        memory = exports.pop("memory")  # never grows, so its numbers stay where they are
        count = memory.data_len(store) // SIZE
        self._numbers = np.ctypeslib.as_array(
            ctypes.cast(memory.data_ptr(store), DOUBLES), (count,)
        )
        self._functions = {name: Function(store, one) for name, one in exports.items()}

    def __call__(self, name: str, *arguments: float) -> Any:
        """Call a function.

        Raises:
            MemoryError, ValueError, RuntimeError: the call was ended, and why.
        """
        try:
            return self._functions[name](*arguments)
        except wasmtime.Trap as error:
            why = self._functions["why"]()
            raise {1: MemoryError, 2: ValueError}.get(why, RuntimeError)(why) from error

    def put(self, numbers: Any) -> int:
        """Reserve room for an array and write it there; its address."""
        array = np.ravel(np.asarray(numbers, float))
        address = self("reserve", max(array.nbytes, SIZE))
        self.write(address, array)
        return address

    def write(self, address: int, numbers: Any) -> None:
        first = address // SIZE
        self._numbers[first : first + len(numbers)] = numbers

    def read(self, address: int, count: int) -> Vector:
        first = address // SIZE
        return self._numbers[first : first + count].copy()

    def put_bytes(self, array: NDArray[Any]) -> tuple[int, NDArray[Any]]:
        """Reserve room for an array of any type; its address, and the room itself."""
        address = self("reserve", array.nbytes)
        room = self._numbers.view(np.uint8)[address : address + array.nbytes]
        there = room.view(array.dtype).reshape(array.shape)
        there[...] = array
        return address, there

    @staticmethod
    def _given(store: wasmtime.Store, name: str, kind: wasmtime.FuncType) -> wasmtime.Func:
        function, code = c.wasmtime_func_t(), machine_code(name)
        callback = ctypes.cast(code.address, c.wasmtime_func_unchecked_callback_t)
        c.wasmtime_func_new_unchecked(
            store._context(), kind.ptr(), callback, None, NO_FINALIZER, ctypes.byref(function)
        )
        return wasmtime.Func._from_raw(function)


class Controller:
    """An `Nmpc` whose solves a module makes, in the units in which it is solved.

    Solutions are dictionaries: value, features, action and all numbers, among others.
    """

    def __init__(self, module: Module, nmpc: Nmpc) -> None:
        problem = browser.problem(nmpc.problem, nmpc.solver, ties_active=nmpc.ties_active)
        self.module, self.nmpc = module, nmpc
        self.n, self.m, self.d = (problem[name] for name in ("states", "inputs", "theta"))
        self._units, self._input_units = map(np.array, (problem["units"], problem["input_units"]))
        self.horizon, rows = len(problem["discount"]) - 1, len(problem["weights"])
        slacks = rows - problem["fixed"] + problem["soft"]
        z = (self.horizon + 1) * (self.n + slacks) + self.horizon * self.m
        lam = (self.horizon + 1) * (self.n + rows)
        self._sizes = [2 * z + lam + fixed * self.m for fixed in (0, 1)]
        self._width = len(problem["data"][0])
        self._default = np.ravel(problem["data"])
        self._data = module.put(browser.packed(problem)) + HEAD * SIZE
        rooms = {
            "state": self.n,
            "theta": self.d,
            "action": self.m,
            "warm": self._sizes[1],
            "out": self._sizes[1] + self.d,
            "report": 5,
            "next": self.n,
            "vector": self.d,
            "states": (self.horizon + 1) * self.n,
            "inputs": self.horizon * self.m,
            "slope": self.d,
        }
        self._at = {name: module.put(np.zeros(size)) for name, size in rooms.items()}

    def _write(self, data=None, state=None, action=None, **numbers) -> None:
        if state is not None:
            numbers["state"] = state / self._units
        if action is not None:
            numbers["action"] = action / self._input_units
        for name, array in numbers.items():
            self.module.write(self._at[name], np.ravel(array))
        self.module.write(self._data, self._default if data is None else np.ravel(data))

    def _places(self, *names: str) -> list[int]:
        return [self._data - HEAD * SIZE, *(self._at[name] for name in names)]

    def solve(self, state, theta, warm_start=None, action=None, data=None):
        """As `Nmpc.solve`; data are those of all stages.

        Raises:
            ArithmeticError: no optimum was found; with the end.
        """
        fixed, known = int(action is not None), -1
        self._write(data, state, action, theta=theta)
        if warm_start is not None:
            known = warm_start["fixed"]
            self._write(data, warm=warm_start["numbers"])
        _, *last = self._places("warm", "out", "report")
        given = self._places("state", "theta", "action")
        end = self.module("nmpc_solve", *given, fixed, known, last[0], 1e-8, *last[1:])
        if end:
            raise ArithmeticError(end)
        value, iterations, restarts, violation, _ = self.module.read(self._at["report"], 5)
        numbers = self.module.read(self._at["out"], self._sizes[fixed] + self.d)
        return {
            "value": value,
            "iterations": int(iterations),
            "restarts": int(restarts),
            "violation": violation,
            "fixed": fixed,
            "numbers": numbers[: -self.d],
            "action": numbers[self.n : self.n + self.m] * self._input_units,
            "features": numbers[-self.d :],
        }

    def slopes(self, state, theta, solution, vector=None, states=None, inputs=None, action=None):
        """`Nmpc.value_hessian_times` plus the gradient of a weighted plan, or None."""
        weights = {"vector": np.zeros(self.d) if vector is None else vector}
        weights["states"] = np.zeros((self.horizon + 1, self.n)) if states is None else states
        weights["inputs"] = np.zeros((self.horizon, self.m)) if inputs is None else inputs
        weights["states"] = weights["states"] * self._units
        weights["inputs"] = weights["inputs"] * self._input_units
        self._write(None, state, action, theta=theta, warm=solution["numbers"], **weights)
        _, *last = self._places("warm", "vector", "states", "inputs", "slope")
        given = self._places("state", "theta", "action")
        formed = self.module("nmpc_slopes", *given, solution["fixed"], *last)
        return self.module.read(self._at["slope"], self.d) if formed else None

    def step(self, state, action, theta=None):
        """x+ of the model, with the data of stage 0."""
        theta = np.zeros(self.d) if theta is None else theta
        self._write(None, state, action, theta=theta)
        self.module("model_step", *self._places("state", "theta", "action", "next"))
        return self.module.read(self._at["next"], self.n) * self._units

    def stage_cost(self, state, action, theta):
        """l of the problem, with the data of stage 0."""
        self._write(None, state, action, theta=theta)
        return self.module("stage_cost", *self._places("state", "theta", "action"))

    def cost(self, state, action, discs=None):
        """As `Task.stage_cost`, among as many obstacles elsewhere if that is asked."""
        data = self._default.copy()
        if discs is not None:
            data[self.n : self._width] = np.ravel(discs)
        self._write(data, state, action)
        return self.module("task_cost", *self._places("state", "action"))
