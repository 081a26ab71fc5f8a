"""Problems, a plant and a task for the tests of control."""

from typing import Any

import casadi as ca
import numpy as np

from nmpcrl.control import Hard, Obstacle, Parameter, Plant, Problem, Series, Soft, Task

BEHIND = {"lower": [-9, -9, -np.inf], "upper": [3, 3, np.inf]}  # the printed box: not the target's


def plant(kind: type[Plant] = Plant, **changes: Any) -> Plant:
    """Two states that are moved by one input alike."""
    fields = {
        "dynamics": lambda state, action: ca.vertcat(action, action),
        "state_names": ("x", "y"), "action_names": ("a",), "lower": [-1.0], "upper": [1.0],
    }  # fmt: skip
    return kind(**fields | changes)


def task(**changes: Any) -> Task:
    """Of the robot, with two obstacles."""
    fields = {
        "start": [-2.5, 1.5, 0.0], "target": [8.5, 2.0, np.pi / 2],
        "lower": [-3.0, -3.0, -np.inf], "upper": [9.0, 9.0, np.inf],
        "obstacles": (Obstacle(0.5, 2.2), Obstacle(3.0, 0.5)),
    }  # fmt: skip
    return Task(**fields | changes)


def point_mass(bound: float = 1e3) -> Plant:
    """A mass that is pushed about the plane: linear, so that RK4 is exact."""
    return Plant(
        dynamics=lambda state, action: ca.vertcat(state[2:], action),
        state_names=("x [m]", "y [m]", "v_x [m/s]", "v_y [m/s]"),
        action_names=("a_x [m/s2]", "a_y [m/s2]"), lower=[-bound] * 2, upper=[bound] * 2,
    )  # fmt: skip


def open_field(box: float = 1e3, **changes: Any) -> Task:
    """A task of the point mass."""
    target = [1.0, -2.0, 0.0, 0.0]
    return Task([0.0] * 4, target, [-box] * 4, [box] * 4, weights=[1.0] * 4, **changes)


def pendulum(kind: type[Problem] = Problem, **changes: Any) -> Problem:
    """A curved plant with everything that a problem may have; each symbol is learned."""
    fields = {
        "states": 2, "inputs": 1, "horizon": 6, "gamma": 0.95, "lower": -1.5, "upper": 1.5,
        "theta": {
            "rate": 1.3, "damping": Parameter(0.2, 0.0, 2.0), "Q": np.diag([1.0, 0.3]), "r": 0.2,
            "limit": np.array([0.7, 0.9]), "offset": 0.5,
        },
        "model": lambda x, u, th, d: ca.vertcat(
            x[0] + 0.2 * x[1],
            x[1] + 0.2 * (-th["rate"] * ca.sin(x[0]) - th["damping"] * x[1] ** 3 + u) + d["wind"],
        ),
        "stage": lambda x, u, th, d: (
            ca.bilin(th["Q"], x - d["target"], x - d["target"]) + th["r"] * u**2
        ),
        "terminal": lambda x, th, d: 3 * ca.sumsqr(th["Q"] @ (x - d["target"])),
        "initial": lambda x, th, d: th["offset"] ** 2 * ca.cos(x[0]),
        "soft": [
            Soft(lambda x, u, th, d: x[1] - th["limit"][0], weight=4.0),
            Soft(lambda x, u, th, d: x[1] * u - th["limit"][1] * ca.cos(x[0]), weight=2.0),
            Soft(lambda x, u, th, d: [x[0] - 1.2, -x[0] - 1.2], weight=[3.0, 5.0], stages=[-1]),
        ],
        "data": {"wind": 0.0, "target": np.zeros(2)},
    }  # fmt: skip
    return kind(**fields | changes)


def limited(**changes: Any) -> Problem:
    """The pendulum with hard rows of states, of both, and at the end, and a box of its states."""
    fields = {
        "soft": [Soft(lambda x, u, th, d: x[0] - th["limit"][1], weight=1.0)],
        "hard": [
            Hard(lambda x, u, th, d: x[1] - th["limit"][0], stages=slice(1, None)),
            Hard(lambda x, u, th, d: 0.5 * x[1] + u - th["limit"][1]),
            Hard(lambda x, u, th, d: x[0] ** 2 - 0.5 * th["limit"][1], stages=-1),
        ],
        "state_lower": [-2.0, -0.6],
    }
    return pendulum(**fields | changes)


def tank(unit: float, row: float = 1.0, cost: float = 1.0, **changes: Any) -> Problem:
    """A pressure and a temperature in any unit, as its soft row and its costs."""

    def model(x: Any, u: Any, th: Any) -> Any:
        pressure = x[0] + 0.1 * (-th["k"] * x[0] + u + 0.1 * unit * ca.sin(x[1] / unit))
        return ca.vertcat(pressure, x[1] + 0.1 * (0.2 * x[0] - (x[1] - unit)))

    def away(x: Any, th: Any) -> Any:
        return ca.sumsqr(x / unit - th["target"])

    fields = {
        "states": 2, "inputs": 1, "horizon": 8, "gamma": 0.95,
        "theta": {"k": 0.3, "target": np.array([1.3, 1.2])},
        "model": model,
        "stage": lambda x, u, th: cost * (away(x, th) + 0.01 * ca.sumsqr(u / unit)),
        "terminal": lambda x, th: cost * 5 * away(x, th),
        "soft": [Soft(lambda x, u, th: row * (x[0] / unit - 1.2), weight=2.0 * cost / row)],
        "lower": -unit, "upper": 2 * unit,
    }  # fmt: skip
    return Problem(**fields | changes)


def drawn(seed: int) -> Problem:
    """Any sizes, a curved model, rows that mix states, inputs, parameters and data."""
    rng = np.random.default_rng(seed)
    n, m, horizon = rng.integers(1, 4), rng.integers(1, 3), rng.integers(1, 6)
    rows = rng.integers(0, 3)
    W, c = rng.normal(size=(n, n)), ca.DM(rng.normal(size=(max(rows, 1), n)))
    e = ca.DM(rng.normal(size=(max(rows, 1), m)))

    def soft(x: Any, u: Any, th: Any, d: Any) -> Any:
        return c @ ca.sin(x) + e @ (th["h"] * u) - th["limit"] + d["shift"]

    return Problem(
        states=int(n), inputs=int(m), horizon=int(horizon), gamma=float(rng.uniform(0.8, 1)),
        theta={
            "A": np.eye(n) + 0.1 * rng.normal(size=(n, n)), "B": rng.normal(size=(n, m)),
            "bend": 0.1 * rng.normal(), "root": rng.uniform(0.3, 1.5, n), "h": 0.5, "limit": 0.5,
        },
        model=lambda x, u, th, d: th["A"] @ x + th["B"] @ u + th["bend"] * ca.sin(ca.DM(W) @ x),
        stage=lambda x, u, th, d: ca.sumsqr(th["root"] * (x - d["shift"])) + 0.3 * ca.sumsqr(u),
        terminal=lambda x, th, d: 2 * ca.sumsqr(x) + th["h"] * ca.sum1(x**4),
        soft=[Soft(soft, weight=3.0)] if rows else (),
        lower=-1.0, upper=1.0, data={"shift": Series(rng.normal(scale=0.3, size=horizon + 1))},
    )  # fmt: skip
