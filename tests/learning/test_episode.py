"""Episodes of the compiled loop are those of the generator, to the last bit."""

import dataclasses

import numpy as np
import pytest
from numba import njit

from nmpcrl.control import Nmpc, Riccati, differential_drive
from nmpcrl.control.solvers import riccati
from nmpcrl.control.solvers.codes import End, Start
from nmpcrl.learning import (
    Diverged,
    Exploration,
    Weights,
    count_episodes,
    count_steps,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
    train,
)
from nmpcrl.learning.episode import NUMBERS, Loop, episodes
from nmpcrl.learning.loop import FIND, SLOPES
from nmpcrl.learning.loop import NUMBERS as OF_LOOP
from nmpcrl.learning.remedies import guarded
from nmpcrl.learning.training import trainer_of
from nmpcrl.study import Experiment, paper
from nmpcrl.study.learners import LEARNERS, NETWORKS, Generators

THETA = np.array(paper.THETA_INIT)
EPISODES, STEPS = 3, 60
MAKE = {
    "ES": lambda nmpc: expected_sarsa(nmpc, 3 * paper.ALPHA),
    "GES": lambda nmpc: gradient_expected_sarsa(nmpc, paper.ALPHA, paper.BETA),
    "TDC": lambda nmpc: gradient_tdc(nmpc, paper.ALPHA, paper.BETA_TDC, projection=paper.THETA_SET),
    "TDC without curvature": lambda nmpc: gradient_tdc(
        nmpc, paper.ALPHA, paper.BETA_TDC, curvature=False
    ),
    "QL": lambda nmpc: q_learning(nmpc, paper.ALPHA),
    "frozen": frozen,
}


def imitating(kind, **fields):
    """A learner with a new network, always the same."""

    def make(nmpc):
        generators = Generators(*map(np.random.default_rng, range(3)))
        return LEARNERS[kind].make(Experiment(kind, alpha=1e-6, **fields), nmpc, generators)

    return make


MAKE |= {
    "DES": imitating("DES"),
    "RDES": imitating("RDES"),
    "RDES literal": imitating("RDES", gated=False),
}
READINGS = [name for name in NETWORKS if name not in ("plain", "greedy")]
OPTIONS = [{}, {"constrained": True}, {"constrained": False, "clipped": False}]
SOLVED, LIMIT, COLD = int(End.SOLVED), float(End.LIMIT), int(Start.COLD)


@pytest.fixture(scope="module")
def nmpc() -> Nmpc:
    return paper.nmpc()


def noise(count=count_steps, episodes=EPISODES, steps=STEPS):
    return Exploration.draw(np.random.default_rng(1), (episodes, steps, 2), count=count)


def weights():
    return Weights(THETA, np.full(9, paper.W_INIT))


def of_steps(steps):
    """What `episodes` has as columns, from the steps of `train`, and the reason of the end."""
    rows, failures, stopped = {}, [], ""
    try:
        for step in steps:
            solution, update, solves = step.solution, step.update, step.solves
            successor = update and update.successor
            row = {
                "cost": step.cost,
                "value": solution.value if solution else np.nan,
                "next_value": successor.value if successor else np.nan,
                "delta": np.nan if not update or update.delta is None else update.delta,
                "loss": successor.loss if successor else np.nan,
                "restarts": sum(one.restarts for one in solves),
                "violation": max([one.violation for one in solves], default=np.nan),
                "iterations": sum(one.iterations for one in solves),
                "solves": len(solves),
                "state": step.state,
                "action": step.action,
                "features": solution.features if solution else np.full(9, np.nan),
                "theta": step.weights.theta,
                "w": step.weights.w,
            }
            for name, value in row.items():
                rows.setdefault(name, []).append(value)
            failures += [step.failure] if step.last or step.failure else []
    except Diverged as error:
        stopped = str(error)
    return rows, failures, stopped


def of_episodes(made):
    rows, failures, stopped = {}, [], ""
    try:
        for episode in made:
            for name, column in episode.columns.items():
                rows.setdefault(name, []).extend(column)
            failures.append(episode.failure)
    except Diverged as error:
        stopped = str(error)
    return rows, failures, stopped


def assert_same(make, nmpc, explore=None, looped=True, **options):
    """The columns, once they are known to be those of the generator."""
    explore = explore or noise()
    start = weights()
    trainer = trainer_of(make(nmpc), nmpc, start, explore, **options)
    assert (Loop.of(trainer) is not None) == looped
    expected, failures, stopped = of_steps(train(make(nmpc), nmpc, start, explore, **options))
    found, ends, why = of_episodes(episodes(make(nmpc), nmpc, start, explore, **options))
    assert list(found) == [*NUMBERS, "state", "action", "features", "theta", "w"]
    for name, column in found.items():
        np.testing.assert_array_equal(column, expected[name], err_msg=name)
    assert why == stopped
    assert ends[: len(failures)] == failures
    return {name: np.array(column) for name, column in found.items()}


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("name", MAKE)
def test_every_learner_makes_the_steps_of_the_generator(nmpc, name, options):
    columns = assert_same(MAKE[name], nmpc, **options)
    moved = not np.array_equal(columns["theta"][-1], THETA)
    assert moved == (name != "frozen")
    assert len(columns["cost"]) == EPISODES * STEPS


@pytest.mark.parametrize("reading", READINGS)
def test_every_reading_of_the_network_makes_the_steps_of_the_generator(nmpc, reading):
    columns = assert_same(imitating("RDES", network=reading, steps=20), nmpc)
    assert np.isfinite(columns["loss"]).any()


def test_noise_may_decay_by_episodes_and_a_start_may_be_drawn(nmpc):
    def start(rng):
        return np.array(paper.START) + rng.uniform(0, 0.3, 3)

    columns = assert_same(MAKE["GES"], nmpc, noise(count_episodes), start=start, rng=4)
    assert len(np.unique(columns["state"][::STEPS, 0])) == EPISODES


def test_the_numbers_of_a_row_have_the_same_order_in_the_compiled_loop():
    assert NUMBERS == OF_LOOP


@pytest.fixture(scope="module")
def failing(nmpc):
    """A controller whose solves fail between two values of x, from a warm start or from all."""
    code = riccati.machine_code(nmpc.problem)

    def controller(*, all_fail):
        @njit(FIND)
        def find(
            data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
            others, drawn, start, tolerance, warm_start, out,
        ):  # fmt: skip
            between = 0.0 < state[0] < 0.3
            value, iterations, ended, violation, error, failed = code(
                data, lower, upper, sides, kind, discount, weights, tie, state, theta, action,
                fixed, others, drawn, COLD if between else start, tolerance, warm_start, out,
            )  # fmt: skip
            ended = LIMIT if between and all_fail else ended
            return value, iterations, ended, violation, error, failed + between

        return paper.nmpc(solver=Riccati(code=lambda _: find))

    return controller


@pytest.mark.parametrize("name", ["ES", "TDC", "QL", "RDES", "frozen"])
def test_a_solve_that_fails_warm_is_begun_anew_by_both(failing, name):
    columns = assert_same(MAKE[name], failing(all_fail=False))
    assert 0 < (columns["restarts"] > 0).sum() < 30


def test_where_every_start_fails_fatrop_takes_over_in_both(failing):
    nmpc = failing(all_fail=True)
    assert_same(MAKE["ES"], nmpc)
    made = list(episodes(MAKE["ES"](nmpc), nmpc, weights(), noise()))
    assert {episode.solver for episode in made} == {"fatrop"}


def test_where_no_solver_finds_an_optimum_the_episode_ends_in_both(failing, monkeypatch):
    monkeypatch.setattr("nmpcrl.control.solvers.nlpsol.Program.solve", raising)
    columns = assert_same(MAKE["ES"], failing(all_fail=True))
    assert np.isnan(columns["delta"]).sum() == EPISODES


def raising(self, state, theta, *_, **__):
    from nmpcrl.control import SolverError

    raise SolverError("failed", state, theta)


def test_without_a_derivative_of_the_plan_dense_algebra_answers_in_both(monkeypatch):
    @njit(SLOPES)
    def slopes(
        data, lower, upper, sides, kind, discount, weights, tie,
        state, theta, action, fixed, solved, w, of_states, of_inputs, out,
    ):  # fmt: skip
        return False

    monkeypatch.setattr(riccati, "slopes_code", lambda _: slopes)
    assert_same(MAKE["TDC"], paper.nmpc(), noise(steps=5))


def test_a_plant_that_runs_away_ends_the_episode_in_both(nmpc):
    robot = differential_drive()
    fast = dataclasses.replace(robot, dynamics=lambda s, a: 3 * s * s + robot.dynamics(s, a))
    columns = assert_same(MAKE["ES"], nmpc, plant=fast)
    assert len(columns["cost"]) < EPISODES * STEPS


@pytest.mark.parametrize(("make", "what"), [
    (lambda nmpc: expected_sarsa(nmpc, 1.0), "theta"),
    (lambda nmpc: gradient_expected_sarsa(nmpc, 1e-9, 1.0), "w"),
])  # fmt: skip
def test_weights_that_leave_all_numbers_are_a_divergence_in_both(nmpc, make, what):
    with pytest.raises(Diverged, match=f"^{what} = .* left the numbers"):
        list(episodes(make(nmpc), nmpc, weights(), noise()))
    assert_same(make, nmpc)


@pytest.mark.parametrize(
    "change",
    [
        lambda nmpc: {"make": lambda n: dataclasses.replace(frozen(n), gamma=0.5)},
        lambda nmpc: {"plant": lambda s, a, _: (nmpc.plant.step(s, a), 1.0, False)},
        lambda nmpc: {"nmpc": paper.nmpc(solver="fatrop")},
        lambda nmpc: {"make": lambda n: guarded(gradient_expected_sarsa(n, 1e-6, 1e-7), 1e-6)},
        lambda nmpc: {"make": imitating("RDES", network="greedy", gated=False)},
    ],
    ids=["gamma", "plant", "solver", "rule", "greedy"],
)
def test_what_the_loop_does_not_know_takes_the_generator(nmpc, change):
    changed = {"make": frozen, "nmpc": nmpc, "explore": noise(steps=3)} | change(nmpc)
    columns = assert_same(**changed, looped=False)
    assert len(columns["cost"]) == EPISODES * 3
