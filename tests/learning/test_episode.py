"""The compiled loop makes the episodes of the generator, to the last bit."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from builders import raising
from learning.small_runs import THETA
from numba import njit

from nmpcrl import learning
from nmpcrl.control import Riccati, SolverError, differential_drive
from nmpcrl.control.solvers import riccati
from nmpcrl.control.solvers.codes import End, Start
from nmpcrl.learning.episode import NUMBERS, Loop, _row, episodes
from nmpcrl.learning.learners import Learner, gradient_td, semi_gradient
from nmpcrl.learning.loop import FIND, SLOPES
from nmpcrl.learning.remedies import guarded
from nmpcrl.learning.training import Trainer
from nmpcrl.study import Experiment, paper
from nmpcrl.study.learners import LEARNERS, NETWORKS, Generators

EPISODES, STEPS = 3, 60


def imitating(kind, **fields):
    """A learner with a new network, always the same."""

    def make(nmpc):
        generators = Generators(*map(np.random.default_rng, range(3)))
        return LEARNERS[kind].make(Experiment(kind, alpha=1e-6, **fields), nmpc, generators)

    return make


TDC = partial(learning.gradient_tdc, alpha=paper.ALPHA, beta=paper.BETA_TDC)
MAKE = {
    "ES": partial(learning.expected_sarsa, alpha=3 * paper.ALPHA),
    "GES": partial(learning.gradient_expected_sarsa, alpha=paper.ALPHA, beta=paper.BETA),
    "TDC": partial(TDC, projection=paper.THETA_SET),
    "TDC without curvature": partial(TDC, curvature=False),
    "QL": partial(learning.q_learning, alpha=paper.ALPHA),
    "DES": imitating("DES"),
    "RDES": imitating("RDES"),
    "RDES literal": imitating("RDES", gated=False),
    "frozen": learning.frozen,
}
READINGS = [name for name in NETWORKS if name not in ("plain", "greedy")]
OPTIONS = [{}, {"constrained": True}, {"constrained": False, "clipped": False}]
LIMIT, COLD = float(End.LIMIT), int(Start.COLD)


def noise(count=learning.count_steps, steps=STEPS):
    return learning.Exploration.draw(np.random.default_rng(1), (EPISODES, steps, 2), count=count)


def weights():
    return learning.Weights(THETA, np.full(9, paper.W_INIT))


def rows_and_ends(made, rows_of):
    """A row a step, whether and why an episode failed, and why learning stopped."""
    rows, failures, stopped = [], [], ""
    try:
        for part in made:
            rows.append(rows_of(part))
            if getattr(part, "last", True):
                failures.append(part.failure)
    except learning.Diverged as error:
        stopped = str(error)
    return np.vstack(rows), failures, stopped


def assert_same(make, nmpc, explore=None, looped=True, **options):
    """Compare rows and ends of the loop and of the generator; return the columns."""
    given = nmpc, weights(), explore or noise()
    assert (Loop.of(Trainer(make(nmpc), *given, **options)) is not None) == looped
    expected, failures, stopped = rows_and_ends(learning.train(make(nmpc), *given, **options), _row)
    made, columns = [], {}

    def rows_of(episode):
        made.append(episode)
        return np.column_stack([*episode.columns.values()])

    found, ends, why = rows_and_ends(episodes(make(nmpc), *given, **options), rows_of)
    np.testing.assert_array_equal(found, expected)
    assert (ends[: len(failures)], why) == (failures, stopped)
    assert list(made[0].columns) == [*NUMBERS, "state", "action", "features", "theta", "w"]
    for name in made[0].columns:
        columns[name] = np.concatenate([episode.columns[name] for episode in made])
    return columns


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("name", MAKE)
def test_every_learner_makes_the_steps_of_the_generator(robot, name, options):
    columns = assert_same(MAKE[name], robot, **options)
    moved = not np.array_equal(columns["theta"][-1], THETA)
    assert moved == (name != "frozen")
    assert len(columns["cost"]) == EPISODES * STEPS


@pytest.mark.parametrize("reading", READINGS)
def test_every_reading_of_the_network_makes_the_steps_of_the_generator(robot, reading):
    columns = assert_same(imitating("RDES", network=reading, steps=20), robot)
    assert np.isfinite(columns["loss"]).any()


def test_noise_may_decay_by_episodes_and_a_start_may_be_drawn(robot):
    def start(rng):
        return np.array(paper.START) + rng.uniform(0, 0.3, 3)

    columns = assert_same(MAKE["GES"], robot, noise(learning.count_episodes), start=start, rng=4)
    assert len(np.unique(columns["state"][::STEPS, 0])) == EPISODES


@pytest.fixture(scope="module")
def failing(robot):
    """A controller whose solves fail between two values of x, from a warm start or from all."""
    code = riccati.machine_code(robot.problem)

    @cache
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


def test_without_an_optimum_an_episode_ends_and_without_a_derivative_algebra_answers_in_both(
    failing, monkeypatch
):
    failed = raising(SolverError("failed", THETA[:3], THETA))
    monkeypatch.setattr("nmpcrl.control.solvers.nlpsol.Program.solve", failed)
    columns = assert_same(MAKE["ES"], failing(all_fail=True))
    assert np.isnan(columns["delta"]).sum() == EPISODES

    @njit(SLOPES)
    def slopes(
        data, lower, upper, sides, kind, discount, weights, tie,
        state, theta, action, fixed, solved, w, of_action, out,
    ):  # fmt: skip
        return False

    monkeypatch.setattr(riccati.Compiled, "slopes", property(lambda _: slopes))
    assert_same(MAKE["TDC"], paper.nmpc(), noise(steps=5))


def test_a_plant_that_runs_away_ends_the_episode_in_both(robot):
    drive = differential_drive()
    fast = replace(drive, dynamics=lambda s, a: 3 * s * s + drive.dynamics(s, a))
    columns = assert_same(MAKE["ES"], robot, plant=fast)
    assert len(columns["cost"]) < EPISODES * STEPS


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (partial(learning.expected_sarsa, alpha=1.0), "theta"),
        (partial(learning.gradient_expected_sarsa, alpha=1e-9, beta=1.0), "w"),
    ],
)
def test_weights_that_leave_all_numbers_are_a_divergence_in_both(robot, make, what):
    with pytest.raises(learning.Diverged, match=f"^{what} = .* left the numbers"):
        list(episodes(make(robot), robot, weights(), noise()))
    assert_same(make, robot)


@pytest.mark.parametrize(
    "change",
    [
        lambda nmpc: {"make": lambda n: replace(learning.frozen(n), gamma=0.5)},
        lambda nmpc: {"plant": lambda s, a, _: (nmpc.plant.step(s, a), 1.0, False)},
        lambda nmpc: {"nmpc": paper.nmpc(solver="fatrop")},
        lambda nmpc: {
            "make": lambda n: guarded(learning.gradient_expected_sarsa(n, 1e-6, 1e-7), 1e-6)
        },
        lambda nmpc: {"make": imitating("RDES", network="greedy", gated=False)},
    ],
    ids=["gamma", "plant", "solver", "rule", "greedy"],
)
def test_parts_that_the_loop_does_not_know_take_the_generator(robot, change):
    changed = {"make": learning.frozen, "nmpc": robot, "explore": noise(steps=3)} | change(robot)
    columns = assert_same(**changed, looped=False)
    assert len(columns["cost"]) == EPISODES * 3


@pytest.mark.parametrize(
    ("inputs", "rule", "message"),
    [(5, gradient_td(1e-7, 1e-7, 0.97), "needs the next state's features: bootstrap by SecondS"),
     (4, semi_gradient(1e-7), "inputs of length 5 must have length 4")],
)  # fmt: skip
def test_parts_that_do_not_fit_each_other_are_refused(robot, inputs, rule, message):
    network = learning.QNetwork(inputs, np.random.default_rng(0), batch=2)
    imitation = learning.Imitation(network, with_theta=False)
    with pytest.raises(ValueError, match=message):
        list(episodes(Learner.of("own", robot, rule, imitation), robot, weights(), noise()))
