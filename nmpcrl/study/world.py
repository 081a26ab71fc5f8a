"""The robot's task where the obstacles move and the model may be wrong, as a `Problem`.

    min   sum_i gamma^i (||theta_x (x_i - s_ref)||^2 + ||theta_u u_i||^2 + omega' sigma_i) + ...
    s.t.  Xi(x_i, o_i) + theta_c <= sigma_i

It is Eq. (2) with centres o_i that are data of each stage, and a box that is priced: data and soft
rows are what a `Problem` knows. In the paper's layouts it has the value of the paper's controller
to seven digits, and not its bits.

**What that does to the theory.** V_theta(s) becomes V_theta(s, t): the state of the Markov chain
includes the time, or the motions' phase. Bootstrapped by a second solve, which is given the data of
t + 1, the TD error is that of the larger chain; a network of (s, a) alone is not. A predictor that
errs makes every value that of another chain, so that the TD error has no zero at the true one.
Within an episode that ends, there is no stationary law of the states to converge under, and
"converges" means over episodes.
"""

from collections.abc import Sequence
from functools import cache
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Problem
from nmpcrl.control.problem import Parameter, Soft
from nmpcrl.control.task import Task, overlap
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import paper
from nmpcrl.study.faults import NONE, Body, Fault, robot
from nmpcrl.study.motions import Motion, Predictor, centres, known

TARGET, LOWER, UPPER = map(np.array, (paper.TARGET, paper.LOWER, paper.UPPER))
TASK: Task = paper.task_among(())  # its numbers are those of the charge
CLEARANCE = 2.5  # d_rob + d_obs [m]
TERMINALS = ("diagonal", "full", "learned")  # costs V^f: the paper's first
BELOW = ((1, 0), (2, 0), (2, 1))  # entries of a triangular factor of V^f that the paper has not
BUMPS = np.array([(x, y) for x in np.linspace(-1, 7, 5) for y in np.linspace(-1, 5, 5)])  # [m]
WIDTHS = np.array([2.0, 1.5])  # of a bump, along x and y [m]: as far as one is from the next
HEIGHT = 1000.0  # of a bump of weight 1: V_theta(s) itself is some thousands
TURNS, MOVES = np.array([0.0, 1.0]), np.eye(2, 3)  # which input a bias adds to, which states drift


def problem(
    obstacles: int = 4, *, learned_model: bool = False, terminal: str = TERMINALS[0]
) -> Problem:
    """Eq. (2) among obstacles whose centres are data.

    theta is that of the paper, and in its order. With `learned_model` the model's own parameters
    follow: f(x, u) is that of the robot under gain u + (0, bias), and then drift. A richer terminal
    cost has parameters behind those, which are 0 where learning begins.

    Args:
        obstacles: M.
        learned_model: whether the model has parameters, too.
        terminal: of `TERMINALS`. "full" is any quadratic of x - s_ref that is nowhere negative,
            by a triangular factor; "learned" adds a weight for each of `BUMPS`.

    Raises:
        ValueError: there is no such terminal cost.
    """
    if terminal not in TERMINALS:
        raise ValueError(f"terminal = {terminal!r} is none of {', '.join(TERMINALS)}")
    first = np.array(paper.THETA_INIT)
    theta: dict[str, Any] = {"x": first[:3], "u": first[3:5], "f": first[5:8], "c": first[8]}
    if learned_model:
        theta |= {
            "gain": Parameter(np.eye(2), -2.0, 2.0),
            "bias": Parameter(0.0, -1.0, 1.0),
            "drift": Parameter(np.zeros(2), -0.5, 0.5),
        }
    if terminal == "full":
        theta["below"] = np.zeros(len(BELOW))
    if terminal == "learned":
        theta["bumps"] = np.zeros(len(BUMPS))

    def model(x: Any, u: Any, th: Any, _: Any) -> Any:
        if not learned_model:
            return robot().transition(x, u)
        applied = th["gain"] @ u + th["bias"] * TURNS
        return robot().transition(x, applied) + robot().period * (th["drift"].T @ MOVES).T

    def stage(x: Any, u: Any, th: Any, _: Any) -> Any:
        return _square(th["x"] * (x - TARGET), 3) + _square(th["u"] * u, 2)

    def final(x: Any, th: Any, _: Any) -> Any:
        away = x - TARGET
        scaled = [th["f"][i] * away[i] for i in range(3)]
        if terminal == "full":
            for k, (i, j) in enumerate(BELOW):
                scaled[i] += th["below"][k] * away[j]
        cost = _square(scaled, 3)
        if terminal == "learned":
            for k, bump in enumerate(BUMPS):
                cost += HEIGHT * th["bumps"][k] / (1 + _square((x[:2] - bump) / WIDTHS, 2)) ** 2
        return cost

    def discs(x: Any, _: Any, th: Any, d: Any) -> Any:
        at = d["centres"]
        return [overlap(x[0], x[1], at[j, 0], at[j, 1], CLEARANCE) + th["c"]
                for j in range(obstacles)]  # fmt: skip

    def walls(x: Any, _: Any, __: Any, ___: Any) -> Any:
        return [side for i in (0, 1) for side in (x[i] - UPPER[i], LOWER[i] - x[i])]

    return Problem(
        states=3, inputs=2, horizon=paper.HORIZON, gamma=paper.GAMMA, theta=theta,
        model=model, stage=stage, terminal=final,
        soft=[Soft(discs, paper.SLACK_WEIGHT), Soft(walls, paper.SLACK_WEIGHT, slice(1, None))],
        lower=robot().lower, upper=robot().upper, data={"centres": np.zeros((obstacles, 2))},
    )  # fmt: skip


@cache
def controller(
    obstacles: int = 4, *, learned_model: bool = False, terminal: str = TERMINALS[0]
) -> Persistent:
    """The NMPC of `problem`, made once, since it is compiled."""
    return Persistent(Nmpc(problem(obstacles, learned_model=learned_model, terminal=terminal)))


def oracle(fault: Fault) -> Vector:
    """Theta_init with the parameters of the model that fit the fault best."""
    return controller(learned_model=True).nmpc.problem.vector(**fault.model)  # type: ignore[union-attr]


def charge(state: Vector, action: Vector, at: Matrix) -> float:
    """Eq. (20) among obstacles with these centres, shape (M, 2): `Task.stage_cost`'s very bits."""
    away, weights = (state - TARGET).tolist(), TASK.weights.tolist()
    cost: float = sum(w * (a * a) for w, a in zip(weights, away, strict=True))
    if sqrt(sum(a * a for a in away)) < TASK.near:
        return cost + sqrt(sum(a * a for a in action.tolist()))
    x, y = state[:2].tolist()
    entered = sum(
        max(0.0, overlap(x, y, cx, cy, CLEARANCE) + TASK.margin) for cx, cy in at.tolist()
    )
    return float(cost + TASK.penalty * entered)


def inside(states: Matrix, motions: Sequence[Motion]) -> NDArray[np.bool_]:
    """Whether the state of each step is in an obstacle, Xi > 0, shape (K + 1, M)."""
    at = centres(motions, np.arange(len(states)))
    away = states[:, None, :2] - at
    found: NDArray[np.bool_] = (away**2).sum(axis=2) < (CLEARANCE / 2) ** 2
    return found


class World:
    """An environment with a clock: what `train` and `evaluate` take as plant, start and data.

    One serves one run at a time: `begin` sets the clock to 0 and draws the body of the episode.
    """

    def __init__(
        self,
        motions: Sequence[Motion],
        predict: Predictor = known,
        *,
        fault: Fault = NONE,
        seen: Sequence[Motion] | None = None,
    ) -> None:
        """Nothing has begun.

        Args:
            motions: of the obstacles.
            predict: what the controller foretells, of `motions.PREDICTORS`.
            fault: how the body differs from the model.
            seen: the obstacles that the controller believes in; `motions` if absent.
        """
        self.motions, self.predict, self.fault = tuple(motions), predict, fault
        self.seen = self.motions if seen is None else tuple(seen)
        self.states: list[Vector] = []  # true ones of the episode so far
        self._body = Body(NONE, np.eye(2))
        self._at = centres(self.motions, np.arange(paper.STEPS + 1))
        self._foretold: dict[int, Matrix] = {}

    @property
    def environment(self) -> dict[str, Any]:
        """What `train` and `evaluate` take."""
        return {"plant": self.step, "start": self.begin, "data": self.data}

    def begin(self, rng: np.random.Generator) -> Vector:
        """The start as it is measured."""
        self._body, self.states = self.fault.draw(rng), [np.array(paper.START)]
        return self._body.measure(self.states[0], rng)

    def step(
        self, _: Vector, action: Vector, rng: np.random.Generator
    ) -> tuple[Vector, float, bool]:
        """The next state as it is measured, and what the true one is charged."""
        state = self.states[-1]
        at = self._at[len(self.states) - 1]
        self.states.append(self._body.step(state, action))
        return self._body.measure(self.states[-1], rng), charge(state, action, at), False

    def data(self, t: int) -> dict[str, Matrix]:
        """The centres of the stages of a plan that begins at t."""
        if t not in self._foretold:
            self._foretold[t] = self.predict(self.seen, t, paper.HORIZON)
        return {"centres": self._foretold[t]}


def _square(terms: Any, size: int) -> Any:
    return sum(terms[i] ** 2 for i in range(size))
