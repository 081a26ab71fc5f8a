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
from nmpcrl.control import Nmpc, Riccati

# wasmtime hands a function one array of 16 bytes a value, for its arguments and its result.
CALLED = types.intp(types.voidptr, types.voidptr, types.CPointer(types.float64), types.uint64)
SIZE = 8  # bytes of a number
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

    def cost(self, state, action, discs=None):
        """As `Task.stage_cost`; obstacles may be elsewhere from now on."""
        states, _, actions, *_ = self._at
        self.module.write(states, state)
        self.module.write(actions, action)
        if discs is not None:
            self.module.write(self._discs, np.ravel(discs))
        return self.module("stage_cost", self.discs, self._discs, self._target, states, actions)


class ProblemController:
    """An `Nmpc` of a `Problem` whose solves a module makes; solutions are those of `Controller`."""

    def __init__(self, module: Module) -> None:
        self.module = module
        sizes = module.put(np.zeros(8))
        module("nmpc_sizes", sizes)
        self.n, self.m, self.d, self.N, _, size, z, lam = map(int, module.read(sizes, 8))
        self._sizes = [2 * z + lam + fixed * self.m for fixed in (0, 1)]
        most = self._sizes[1] + self.d
        rooms = {
            "data": (self.N + 1) * size,
            "state": self.n,
            "theta": self.d,
            "action": self.m,
            "warm": most,
            "out": most,
            "report": max(5, self.n),
            "vector": self.d,
            "states": (self.N + 1) * self.n,
            "inputs": self.N * self.m,
            "slope": self.d,
            "least": self.d,
            "most": self.d,
        }
        self.at = {name: module.put(np.zeros(size)) for name, size in rooms.items()}
        names = ("data", "theta", "least", "most", "action", "state")
        module("nmpc_defaults", *(self.at[name] for name in names))
        self.theta = module.read(self.at["theta"], self.d)
        self.data = module.read(self.at["data"], rooms["data"])

    def _write(self, **numbers) -> None:
        for name, array in numbers.items():
            if array is not None:
                self.module.write(self.at[name], np.ravel(array))

    def _places(self, *names: str) -> list[int]:
        return [self.at[name] for name in names]

    def begin(self, state, theta, data=None):
        """As `Nmpc.solve` where there is neither a warm start nor an action."""
        self._write(state=state, theta=theta, data=self.data if data is None else data)
        given = self._places("data", "state", "theta")
        end = self.module("nmpc_begin", *given, 1e-8, *self._places("out", "report"))
        return self._found(end, 0)

    def solve(self, state, theta, warm_start=None, action=None, data=None):
        """As `Nmpc.solve` with one cold start; data are those of all stages.

        Raises:
            ArithmeticError: no optimum was found; with the end.
        """
        fixed, known = int(action is not None), -1
        self._write(state=state, theta=theta, action=action)
        self._write(data=self.data if data is None else data)
        if warm_start is not None:
            known = warm_start["fixed"]
            self._write(warm=warm_start["numbers"])
        given = self._places("data", "state", "theta", "action")
        end = self.module(
            "nmpc_solve",
            *given,
            fixed,
            known,
            self.at["warm"],
            1e-8,
            *self._places("out", "report"),
        )
        return self._found(end, fixed)

    def _found(self, end, fixed):
        if end:
            raise ArithmeticError(end)
        value, iterations, restarts, *_ = self.module.read(self.at["report"], 5)
        numbers = self.module.read(self.at["out"], self._sizes[fixed] + self.d)
        return {
            "value": value,
            "iterations": int(iterations),
            "restarts": int(restarts),
            "fixed": fixed,
            "numbers": numbers,
            "action": numbers[self.n : self.n + self.m],
            "features": numbers[-self.d :],
        }

    def slopes(self, state, theta, solution, vector, states, inputs, action=None):
        """`Nmpc.value_hessian_times` and the gradient of a weighted plan, or None."""
        self._write(state=state, theta=theta, action=action, warm=solution["numbers"])
        self._write(vector=vector, states=states, inputs=inputs)
        given = self._places("data", "state", "theta", "action")
        there = self._places("warm", "vector", "states", "inputs", "slope")
        formed = self.module("nmpc_slopes", *given, solution["fixed"], *there)
        return self.module.read(self.at["slope"], self.d) if formed else None

    def step(self, state, action, theta):
        """x+ of the model, with the data of stage 0."""
        self._write(state=state, theta=theta, action=action)
        given = self._places("data", "state", "action", "theta")
        self.module("model_step", *given, self.at["report"])
        return self.module.read(self.at["report"], self.n)

    def cost(self, state, action, theta):
        """l, with the data of stage 0."""
        self._write(state=state, theta=theta, action=action)
        return self.module("stage_cost", *self._places("data", "state", "action", "theta"))
