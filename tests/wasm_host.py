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


class Module:
    """An instance of a module; its functions are called by name, arrays are put and read."""

    def __init__(self, data: bytes) -> None:
        engine, module = compiled(data)
        self._store = store = wasmtime.Store(engine)
        self.imports = sorted(one.name for one in module.imports)
        given = [self._given(store, one.name, one.type) for one in module.imports]
        exports = dict(wasmtime.Instance(store, module, given).exports(store))
        memory = exports.pop("memory")  # never grows, so its numbers stay where they are
        count = memory.data_len(store) // SIZE
        self._numbers = np.ctypeslib.as_array(
            ctypes.cast(memory.data_ptr(store), DOUBLES), (count,)
        )
        self._functions = {
            name: (one, [float if str(kind) == "f64" else int for kind in one.type(store).params])
            for name, one in exports.items()
        }

    def __call__(self, name: str, *arguments: float) -> Any:
        """Call a function.

        Raises:
            MemoryError, ValueError, RuntimeError: the call was ended, and why.
        """
        function, kinds = self._functions[name]
        given = [kind(number) for kind, number in zip(kinds, arguments, strict=True)]
        try:
            return function(self._store, *given)
        except wasmtime.Trap as error:
            why = self("why")
            raise {1: MemoryError, 2: ValueError}.get(why, RuntimeError)(why) from error

    def put(self, numbers: Any, kind: Any = float) -> int:
        """Reserve room for an array and write it there; its address."""
        array = np.ravel(np.asarray(numbers, kind))
        address: int = self("reserve", max(array.nbytes, SIZE))
        self._numbers.view(np.uint8)[address : address + array.nbytes] = array.view(np.uint8)
        return address

    def write(self, address: int, numbers: Any) -> None:
        first = address // SIZE
        self._numbers[first : first + len(numbers)] = numbers

    def read(self, address: int, count: int) -> Vector:
        first = address // SIZE
        return self._numbers[first : first + count].copy()

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
        self._units = {"state": problem["units"], "action": problem["input_units"]}
        N, rows = len(problem["discount"]) - 1, len(problem["weights"])
        slacks = rows - problem["fixed"] + problem["soft"]
        z, lam = (N + 1) * (self.n + slacks) + N * self.m, (N + 1) * (self.n + rows)
        self._sizes = [2 * z + lam + fixed * self.m for fixed in (0, 1)]
        self._width = len(problem["data"][0])
        self._default = np.ravel(problem["data"])
        shapes = {
            "state": self.n, "theta": self.d, "action": self.m, "warm": self._sizes[1],
            "out": self._sizes[1] + self.d, "report": 5, "next": self.n, "vector": self.d,
            "weights": self.m, "slope": self.d,
        }  # fmt: skip
        self._zeros = {name: np.zeros(shape) for name, shape in shapes.items()}
        self._at = {"problem": module.put(browser.packed(problem))}
        self._at |= {name: module.put(zeros) for name, zeros in self._zeros.items()}

    def _call(self, name: str, *arguments: Any, data: Any = None, **numbers: Any) -> Any:
        """Call a function; an argument that is a name stands for the address of its numbers."""
        written = self._default if data is None else np.ravel(data)
        self.module.write(self._at["problem"] + HEAD * SIZE, written)
        for one, array in numbers.items():
            array = self._zeros[one] if array is None else array
            if one in ("state", "action"):
                array = array / np.array(self._units[one])
            elif one == "weights":
                array = array * np.array(self._units["action"])
            self.module.write(self._at[one], np.ravel(array))
        return self.module(name, *(self._at.get(one, one) for one in ("problem", *arguments)))

    def solve(self, state, theta, warm_start=None, action=None, data=None):
        """As `Nmpc.solve`; data are those of all stages.

        Raises:
            ArithmeticError: no optimum was found; with the end.
        """
        fixed, known = int(action is not None), -1
        numbers = {"state": state, "theta": theta, "action": action, "data": data}
        if warm_start is not None:
            known, numbers["warm"] = warm_start["fixed"], warm_start["numbers"]
        given = ("state", "theta", "action", fixed, known, "warm", 1e-8, "out", "report")
        end = self._call("nmpc_solve", *given, **numbers)
        if end:
            raise ArithmeticError(end)
        value, iterations, restarts, violation, _ = self._read("report", 5)
        found = self._read("out", self._sizes[fixed] + self.d)
        return {
            "value": value,
            "iterations": int(iterations),
            "restarts": int(restarts),
            "violation": violation,
            "fixed": fixed,
            "numbers": found[: -self.d],
            "action": found[self.n : self.n + self.m] * self._units["action"],
            "features": found[-self.d :],
        }

    def slopes(self, state, theta, solution, vector=None, weights=None, action=None):
        """`Nmpc.value_hessian_times` plus the gradient of a weighted sum of u_0, or None."""
        given = ("state", "theta", "action", solution["fixed"], "warm", "vector", "weights")
        numbers = {"state": state, "theta": theta, "action": action, "warm": solution["numbers"]}
        formed = self._call(
            "nmpc_slopes", *given, "slope", vector=vector, weights=weights, **numbers
        )
        return self._read("slope", self.d) if formed else None

    def step(self, state, action, theta=None):
        """x+ of the model, with the data of stage 0."""
        given = ("state", "theta", "action", "next")
        self._call("model_step", *given, state=state, theta=theta, action=action)
        return self._read("next", self.n) * self._units["state"]

    def stage_cost(self, state, action, theta):
        """l of the problem, with the data of stage 0."""
        numbers = {"state": state, "theta": theta, "action": action}
        return self._call("stage_cost", *numbers, **numbers)

    def cost(self, state, action, discs=None):
        """As `Task.stage_cost`, among as many obstacles elsewhere if that is asked."""
        data = self._default.copy()
        if discs is not None:
            data[self.n : self._width] = np.ravel(discs)
        return self._call("task_cost", "state", "action", data=data, state=state, action=action)

    def _read(self, name: str, count: int) -> Vector:
        return self.module.read(self._at[name], count)
