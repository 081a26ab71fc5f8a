"""Learners on the example of Gros and Zanon (2020), and what the choice of a solver moves there.

Part "learners": every arm meets the same disturbance and noise of a seed. Step sizes were chosen
with three other seeds, from three to six values each; the one of "LSTD-Q, every step" is that of
mpcrl's example. Part "references": costs of a step that the learners are compared with.

Part "spread": mpcrl's Q-learning with several solvers, then ours with the same disturbances. mpcrl
acts with what it planned before a step of theta: the order "before". `train` plans anew: "after".
`other_problems.toml` has the predictions.
"""

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import sparse
from scipy.interpolate import interpn
from scipy.sparse.linalg import spsolve

from nmpcrl import Matrix, Vector, learning
from nmpcrl.claims.verdict import NOT, REPRODUCED
from nmpcrl.control import Nmpc, SolverError
from nmpcrl.learning import Diverged, Exploration, Learner, Weights, td_error, train
from nmpcrl.studies.investigation import Answer, Investigation, Part, Row, questions
from nmpcrl.study.problems import gros_zanon as gz

STEPS, WINDOW = 1000, 50  # of a run, and those whose costs are averaged
DEVIATION = 0.05  # of the normal noise that is added to the action
SEEDS = 50
EPISODE = 100  # steps of an episode without noise on the action
TEST = (20, 10**6)  # episodes, and the seed of their disturbances
SEARCH = (10, 2 * 10**6)  # of the cost that the search sees
POINTS, INPUTS = 161, 121  # of the grid on which the best policy is found
BUDGET, SPREAD = 400, 0.05  # thetas that the search tries, and how far from the start it begins
PEER_STEPS = 100  # of mpcrl's own test, whose seed is 69
RATE, RIDGE = 0.05, 1e-3
NUDGE = 1e-10  # of theta as it begins
PEERS = ("ipopt", "ipopt, 1e-10", "fatrop")
LEAST, MOST = np.array([-0.6, -1.2]), np.array([1.4, 1.2])  # corners of the grid
SWEEPS = 100  # of policy iteration, at most
NODES = 8  # midpoints at which the disturbance is taken
CORNERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])  # of a cell of the grid

ARMS: Mapping[str, Callable[[Nmpc], Learner]] = {
    "frozen": learning.frozen,
    "LSTD-Q, every step": lambda nmpc: learning.lstd_q(nmpc, 0.05, every=1),
    "LSTD-Q, batches of 20": lambda nmpc: learning.lstd_q(nmpc, 0.02, every=20),
    "QL": lambda nmpc: learning.q_learning(nmpc, 1e-4),
    "ES": lambda nmpc: learning.expected_sarsa(nmpc, 1e-4),
    "TDC": lambda nmpc: learning.gradient_tdc(nmpc, 1e-4, 1e-4),
    "DPG": lambda nmpc: learning.policy_gradient(nmpc, 1e-3, every=100),
}
ROW: Row = {  # the defaults of a row
    "test": np.nan,  # mean cost of a step without noise on the action, with the last theta
    "before": np.nan,  # J of ours in mpcrl's order
    "nudged": np.nan,  # the same from theta + `NUDGE`
    "after": np.nan,  # J of ours with the newest theta
    "costs": [],  # mean over each window of training, infinite after divergence
    "theta": [],
    "peers": [],  # J of mpcrl by solver
    "made": [],  # steps of each
    "gap": [],  # largest difference of theta after each step between the runs before and nudged
}


@cache
def controller() -> Nmpc:
    """The NMPC whose theta is learned."""
    return Nmpc(gz.problem())


def learn(make: Callable[[Nmpc], Learner], _: str, __: int, seed: int) -> Row:
    """Train a learner for one episode, and test the theta that it ends with."""
    disturbance, noise = (np.random.default_rng([k, seed]) for k in (0, 1))
    explore = Exploration(DEVIATION * noise.normal(size=(1, STEPS, 1)), np.ones((1, STEPS)))
    costs, theta = np.full(STEPS, np.inf), gz.problem().theta
    weights, learner = Weights(theta, np.zeros(theta.size)), make(controller())
    world: dict[str, Any] = {"plant": gz.plant, "start": gz.START, "rng": disturbance}
    try:
        for step in train(learner, controller(), weights, explore, **world):
            costs[step.time], theta = step.cost, step.weights.theta
        test = judge(theta)
    except Diverged:
        test = np.inf
    windows = np.nan_to_num(costs, nan=np.inf).reshape(-1, WINDOW).mean(axis=1)
    return ROW | {"test": test, "costs": windows.tolist(), "theta": theta.tolist()}


def judge(theta: Vector, test: tuple[int, int] = TEST) -> float:
    """Mean cost of a step of the plan's policy; infinite where a solve failed."""
    plan = None

    def act(state: Vector) -> Vector:
        nonlocal plan
        plan = controller().solve(state, theta, plan)
        return plan.action

    try:
        return mean_cost(act, test)
    except (SolverError, ValueError):
        return np.inf


def mean_cost(act: Callable[[Vector], Vector], test: tuple[int, int] = TEST) -> float:
    """Mean cost of a step of any policy, over episodes from the start."""
    (episodes, seed), total = test, 0.0
    rng = np.random.default_rng(seed)
    for _ in range(episodes):
        state = gz.START
        for _ in range(EPISODE):
            state, cost, _ = gz.plant(state, act(state), rng)
            total += cost
    return total / (episodes * EPISODE)


def searched() -> Vector:
    """The theta of the least mean cost that CMA-ES finds; its disturbances are not the test's."""
    import cma  # takes a second

    def cost(theta: Any) -> float:
        return min(judge(np.asarray(theta), SEARCH), 1e6)

    options = {"seed": 1, "verbose": -9, "maxfevals": BUDGET}
    return np.asarray(cma.fmin2(cost, gz.problem(informed=True).theta, SPREAD, options)[0])


def refer(theta: Callable[[], Vector] | None, *_: Any) -> Row:
    """The test of the NMPC with a theta, or of the policy of dynamic programming."""
    if theta is None:
        return ROW | {"test": mean_cost(best(POINTS, INPUTS).action)}
    found = theta()
    return ROW | {"test": judge(found), "theta": found.tolist()}


class Grid(NamedTuple):
    """The value and the best input at each point of a grid of states."""

    axes: Matrix  # shape (2, points)
    value: Matrix  # shape (points, points)
    policy: Matrix  # shape (points, points)

    def action(self, state: Vector) -> Vector:
        """The input in a state, shape (1,)."""
        found: Vector = interpn(self.axes, self.policy, np.clip(state, LEAST, MOST))
        return np.clip(found, -1, 1)


def best(points: int, inputs: int) -> Grid:
    """The best policy on points^2 states, by `inputs` in [-1, 1]; a parabola refines the best.

    Howard's policy iteration interpolates values bilinearly between the points, and takes the
    expectation over e at the midpoints of equal intervals.
    """
    axes = np.linspace(LEAST, MOST, points).T
    states = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    actions, everyone = np.linspace(-1, 1, inputs), np.arange(len(states))
    moves = [_transition(states, np.array([a]), axes) for a in actions]
    outside = np.maximum(0, gz.LOWER - states) + np.maximum(0, states - gz.UPPER)
    squares = (states**2).sum(axis=1) + 0.5 * actions[:, None] ** 2
    costs = 0.5 * (squares + gz.PENALTY * outside.sum(axis=1))
    chosen = np.zeros(len(states), int)
    for _ in range(SWEEPS):
        closed = _transition(states, actions[chosen, None], axes)
        value = spsolve(sparse.eye(len(states), format="csc") - gz.GAMMA * closed.tocsc(),
                        costs[chosen, everyone])  # fmt: skip
        q = costs + gz.GAMMA * np.stack([move @ value for move in moves])
        better = q.argmin(axis=0)
        gained = q[chosen, everyone] - q[better, everyone] > 1e-10
        if not gained.any():
            break
        chosen = np.where(gained, better, chosen)
    shape = (points, points)
    return Grid(axes, value.reshape(shape), _refined(q, actions, chosen).reshape(shape))


def _transition(states: Matrix, action: Matrix, axes: Matrix) -> sparse.csr_array:
    """The probability of each successor of each point, by bilinear weights."""
    low, high = gz.DISTURBANCE
    e = low + (np.arange(NODES) + 0.5) / NODES * (high - low)
    later = (states @ gz.TRUE_A.T + action * gz.TRUE_B[:, 0])[:, None] + np.c_[e, np.zeros(NODES)]
    last = axes.shape[1] - 1
    at = np.clip((later - LEAST) / (axes[:, 1] - axes[:, 0]), 0, last)
    below = np.minimum(at.astype(int), last - 1)
    above = (at - below)[:, :, None]  # share of the way to the next point
    weights = np.where(CORNERS, above, 1 - above).prod(axis=-1) / NODES
    columns = (below[:, :, None] + CORNERS) @ [last + 1, 1]
    ends = np.arange(len(states) + 1) * (4 * NODES)
    found = sparse.csr_array((weights.ravel(), columns.ravel(), ends), (len(states),) * 2)
    found.sum_duplicates()
    return found


def _refined(q: Matrix, actions: Vector, chosen: NDArray[np.int_]) -> Vector:
    """The minimum of the parabola through the best input and its neighbours."""
    middle = np.clip(chosen, 1, len(actions) - 2)
    left, here, right = (q[middle + k, np.arange(q.shape[1])] for k in (-1, 0, 1))
    bend = left - 2 * here + right
    shift = np.where(bend > 1e-12, 0.5 * (left - right) / np.maximum(bend, 1e-12), 0)
    refined: Vector = actions[middle] + np.clip(shift, -1, 1) * (actions[1] - actions[0])
    return np.clip(refined, -1, 1)


def spread(_: Any, __: str, ___: int, seed: int) -> Row:
    """Q-learning with one seed: by mpcrl with each solver, and by this library."""
    from nmpcrl.study.problems import peers  # takes seconds to import

    theirs, disturbances = zip(*(peers.run(one, seed, PEER_STEPS) for one in PEERS), strict=True)
    e = max(disturbances, key=len)
    theta = gz.problem().theta
    nudge = NUDGE * np.random.default_rng(seed).normal(size=theta.size)
    before, path = q_learn(theta, e)
    nudged, near = q_learn(theta + nudge, e)
    after, _ = q_learn(theta, e, newest=True)
    return ROW | {
        "before": before, "nudged": nudged, "after": after,
        "peers": [float(costs.sum()) for costs in theirs],
        "made": [len(costs) for costs in theirs],
        "gap": np.abs(near - path).max(axis=1).tolist(),
    }  # fmt: skip


def q_learn(theta: Vector, e: Vector, *, newest: bool = False) -> tuple[float, Matrix]:
    """J and the thetas of Q-learning under some disturbances, without exploration.

    With `newest` it plans anew after theta has moved, before acting.
    """
    nmpc, state, costs, path = controller(), gz.START, [], []
    plan = nmpc.solve(state, theta)
    for one in e:
        if newest:
            plan = nmpc.solve(state, theta, plan)
        action = plan.action
        solution = nmpc.solve(state, theta, plan, action)
        costs.append(gz.cost(state, action))
        state = gz.TRUE_A @ state + gz.TRUE_B @ action + np.array([one, 0.0])
        plan = nmpc.solve(state, theta, plan)
        delta = td_error(costs[-1], gz.GAMMA, solution.value, plan.value)
        phi = solution.features  # mpcrl's step of Newton: phi phi' + 1e-3 I for a Hessian
        theta = theta + RATE * delta * phi / (RIDGE + phi @ phi)
        path.append(theta)
    return float(np.sum(costs)), np.array(path)


class Runs(NamedTuple):
    """The rows by part, of which questions are asked and figures drawn."""

    tests: pd.DataFrame  # the last cost, a row a seed and a column an arm
    courses: pd.DataFrame  # of the learners
    references: "pd.Series[float]"  # test by arm
    spreads: pd.DataFrame  # with a column for J of each of `PEERS`, and "steps of" each

    @property
    def medians(self) -> "pd.Series[float]":
        """The median of the last costs, by arm."""
        return self.tests.median()


def runs(table: pd.DataFrame) -> Runs:
    """The rows of a table by part."""
    courses, references, spreads = (
        table[table.part == part].reset_index(drop=True)
        for part in ("learners", "references", "spread")
    )
    spreads[[*PEERS]] = [*spreads.peers]
    spreads[[f"steps of {one}" for one in PEERS]] = [*spreads.made]
    tests = courses.set_index(["k", "arm"]).test.unstack()[[*ARMS]]
    return Runs(tests, courses, references.set_index("arm").test, spreads)


def _most(yes: Any) -> bool:
    """Whether at least 45 of 50 seeds say yes, of every arm."""
    return bool(np.min(yes.mean()) >= 0.9)


def _single(found: Runs) -> bool:
    apart = (found.spreads["ipopt"] / found.spreads["ipopt, 1e-10"] - 1).abs()
    return bool(apart.median() > 0.005 and apart.max() > 0.03)


def _alike(first: str, second: str, found: Runs) -> bool:
    """Whether two means of J differ by less than 1 %."""
    return bool(abs(found.spreads[first].mean() / found.spreads[second].mean() - 1) < 0.01)


_PREDICTED: Mapping[str, Callable[[Runs], bool]] = {  # whether it comes true
    "informed": lambda found: _most(
        found.tests[["QL", "ES", "DPG"]] < found.references["informed"]),
    "every step": lambda found: found.medians["LSTD-Q, every step"] > found.medians["QL"],
    "optimum": lambda found: (
        found.medians.drop("frozen") > 1.2 * found.references["best_policy"]).all(),
    "alike": lambda found: abs(found.medians["QL"] / found.medians["ES"] - 1) < 0.3,
    "stable": lambda found:
        np.isfinite(found.tests[["QL", "ES", "TDC", "DPG"]]).mean().min() >= 0.96,
    "single": _single,
    "mean": partial(_alike, "ipopt", "ipopt, 1e-10"),
    "fatrop": lambda found: _most(found.spreads["steps of fatrop"] < PEER_STEPS),
    "ours": partial(_alike, "before", "ipopt, 1e-10"),
    "chaos": lambda found: _most(found.spreads.gap.map(max) > 1e-4),
    "order": lambda found: _most(found.spreads.after < found.spreads.before),
}  # fmt: skip


def _came_true(holds: Callable[[Runs], bool], found: Runs) -> Answer:
    return Answer(REPRODUCED if holds(found) else NOT)


PLACE = ("Gros and Zanon",)
REFERENCES = {
    "wrong": lambda: gz.problem().theta,
    "informed": lambda: gz.problem(informed=True).theta,
    "best_theta": searched,
    "best_policy": None,
}
OTHER_PROBLEMS = Investigation(
    name="other_problems",
    parts={
        "references": Part(refer, REFERENCES, PLACE, 1, seconds=60),
        "spread": Part(spread, {"Q-learning": None}, PLACE, 1, SEEDS, seconds=5),
        "learners": Part(learn, ARMS, PLACE, 1, SEEDS, seconds=1),
    },
    questions=questions(
        __file__, {name: partial(_came_true, holds) for name, holds in _PREDICTED.items()}
    ),
    seed=lambda _, k: k,
    evidence=runs,
    digits=7,
)
