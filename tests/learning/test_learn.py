"""`learn`, noise by numbers of episodes and steps, and plants that are told the time."""

import pickle
import warnings

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Nmpc, Parameter, Problem
from nmpcrl.learning import (
    Episode,
    Exploration,
    Learner,
    SecondSolve,
    UpdateRule,
    Weights,
    as_gymnasium,
    evaluate,
    learn,
    lstd_q,
    q_learning,
    scheduled,
    train,
)
from nmpcrl.learning.learn import _violated


def problem(**changes) -> Problem:
    """A level to be held at 1, whose gain the plan has wrong."""
    fields = {
        "states": 1, "inputs": 1, "horizon": 4, "gamma": 0.9, "lower": -1, "upper": 1,
        "theta": {"gain": Parameter(0.5, 0.1, 2), "weight": 1.0, "V0": 0.0},
        "model": lambda x, u, th: 0.9 * x + th["gain"] * u,
        "stage": lambda x, u, th: th["weight"] * ca.sumsqr(x - 1) + 0.1 * ca.sumsqr(u),
        "initial": lambda x, th: th["V0"],
    }  # fmt: skip
    return Problem(**fields | changes)


@pytest.fixture(scope="module")
def nmpc() -> Nmpc:
    return Nmpc(problem(), solver="fatrop")


def plant(x, u, rng):
    """Another gain, and disturbances."""
    return 0.9 * x + 0.7 * u + 0.02 * rng.normal(), float((x[0] - 1) ** 2 + 0.1 * u[0] ** 2), False


def start(rng):
    return rng.uniform(0, 1, 1)


WORLD = {"plant": plant, "start": start}


def test_lstd_q_learns_a_constant_value_as_the_closed_form_has_it():
    """Q = V0 + a^2 and a plant that costs 2 + a^2: V0 <- 2 + gamma V0 after each episode."""
    still = problem(
        theta={"V0": 0.0}, model=lambda x, u, th: 0 * x, stage=lambda x, u, th: ca.sumsqr(u)
    )
    result = learn(
        Nmpc(still, solver="fatrop"), plant=lambda x, u, rng: (x, 2 + u @ u, False), start=[0.0],
        episodes=6, steps=4, regularisation=0.0,
    )  # fmt: skip
    ended = result.history["theta"][3::4, 0]
    assert ended == pytest.approx(2 * (1 - 0.9 ** np.arange(1, 7)) / (1 - 0.9), rel=1e-7)
    assert result.theta == {"V0": ended[-1]}
    assert result.vector.tolist() == result.policy.theta.tolist() == [ended[-1]]


def test_learn_makes_the_steps_of_train(nmpc):
    result = learn(nmpc, "QL", alpha=1e-2, episodes=3, steps=5, deviation=0.2, seed=4, **WORLD)
    explore = Exploration(episodes=3, steps=5, deviation=0.2, seed=4)
    weights = Weights(nmpc.problem.theta)
    made = list(train(q_learning(nmpc, 1e-2), nmpc, weights, explore, rng=4, **WORLD))
    assert result.history["theta"].tolist() == [step.weights.theta.tolist() for step in made]
    assert result.history["cost"].tolist() == [step.cost for step in made]
    assert result.history["episode"].tolist() == [step.episode for step in made]


@pytest.mark.parametrize("undo", [False, True])
def test_a_run_goes_on_to_the_last_bit_in_another_process_too(nmpc, undo):
    """A batch of 7 steps goes over the 5 of an episode, and the plant draws."""
    how = WORLD | {"steps": 5, "every": 7, "seed": 3, "confirm": 2, "undo": undo}
    whole = learn(nmpc, episodes=6, **how)
    half = pickle.loads(pickle.dumps(learn(nmpc, episodes=3, **how)))
    seen = []
    for _ in range(2):  # the first half is as it was, and goes on again
        both = learn(nmpc, episodes=3, resume=half, callback=lambda e: seen.append(e.number), **how)
        for name, values in whole.history.items():
            np.testing.assert_array_equal(both.history[name], values)
        assert both.vector.tolist() == whole.vector.tolist()
        assert both.costs.tolist() == whole.costs.tolist()
    assert seen == [3, 4, 5] * 2
    assert half.episodes == 3
    assert len(whole.costs) == 4


def test_an_episode_that_failed_is_told_once_and_a_theta_of_no_use_is_refused(nmpc):
    away = {"plant": lambda x, u, rng: (x * np.nan, 0.0, False), "start": [0.0]}
    with pytest.warns(UserWarning, match=r"^episode 0 ended: no plan can begin in .*nan") as found:
        result = learn(nmpc, episodes=3, **away)
    assert [str(one.message) for one in found] == [*result.warnings]
    with pytest.raises(ValueError, match=r"^theta \[1.e\+09 .*must hold finite numbers"):
        learn(nmpc, theta=[1e9, 1, 0], episodes=2, **WORLD)


def test_plans_that_violate_hard_rows_are_told_where_they_are_many():
    shares = {"violation": np.array([0.0, 2e-3, np.nan, 1e-9, 0.5, 0.1, 0.1, 0.1, 0.1, 0.2])}
    assert _violated(Episode(3, shares, Weights(np.ones(1)))).startswith(
        "in 70% of the steps of episode 3 no plan keeps to all hard rows"
    )
    shares["violation"][:-1] = 0
    assert not _violated(Episode(3, shares, Weights(np.ones(1))))


def test_a_divergence_a_long_step_and_noise_that_is_clipped_are_told_with_their_numbers():
    nmpc, how = Nmpc(problem(), solver="fatrop"), WORLD | {"episodes": 20, "steps": 5}
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        result = learn(nmpc, "QL", alpha=50.0, **how)
    assert {str(one.message) for one in found} >= {*result.warnings}
    assert result.diverged
    assert any("weight turned negative, and a cost" in one for one in result.warnings)
    assert np.abs(result.vector).max() <= nmpc.largest
    assert result.policy([0.5]).shape == (1,)
    first = result.history["features"][result.history["episode"] == 0]
    longest = np.square(np.linalg.norm(first, axis=1)).max()
    said = next(one for one in result.warnings if "phi" in one)
    assert float(said.split("below ")[-1]) == pytest.approx(2 / longest, rel=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        learn(nmpc, episodes=2, steps=10, plant=lambda x, u, rng: (x - 9, 0.0, False), start=[0.0])
    with pytest.warns(UserWarning, match="where noise is clipped: deviation=") as found:
        result = learn(nmpc, deviation=3.0, episodes=2, steps=10, **WORLD)
    shares = [(result.history["action"] == side).mean() for side in (-1, 1)]
    text = next(str(one.message) for one in found if "shares" in str(one.message))
    assert text.startswith("shares of [{:.4g}] and [{:.4g}] of".format(*shares))


def test_confirming_rollouts_are_those_of_evaluate_and_undo_goes_back_to_the_best(nmpc):
    """The gain is first moved towards the plant's, and then away from it."""
    worse = UpdateRule(lambda theta, n, *_: (theta + [[0.1, 0, 0], [0.7, 0, 0]][n > 5], n + 1),
                       lambda weights: 0)  # fmt: skip
    learner = Learner("worse", SecondSolve(nmpc), worse, nmpc.gamma)
    how = {"plant": lambda x, u, rng: (0.9 * x + 0.7 * u, float((x[0] - 1) ** 2), False)}
    how |= {"start": [0.0], "steps": 3}
    plain = learn(nmpc, learner, episodes=3, confirm=1, **how)
    at = [nmpc.problem.theta, *plain.history["theta"][2::3]]
    costs = [evaluate(nmpc, theta, **how).cost for theta in at]
    assert plain.costs == pytest.approx(costs)
    assert plain.vector.tolist() == at[-1].tolist()
    undone = learn(nmpc, learner, episodes=3, undo=True, **how)
    best = int(np.argmin(undone.costs))
    kept = [nmpc.problem.theta, *undone.history["theta"][2::3]][best]
    assert undone.vector.tolist() == kept.tolist()
    assert undone.costs[best] == pytest.approx(evaluate(nmpc, undone.vector, **how).cost)


def test_a_callback_ends_learning_and_noise_of_fewer_episodes_is_the_same(nmpc):
    result = learn(nmpc, episodes=9, steps=2, callback=lambda e: e.number < 2, **WORLD)
    assert result.episodes == 3
    assert len(result.history["cost"]) == 6
    all_of_it = Exploration(episodes=40, steps=500, deviation=[0.1, 2.0], seed=1)
    assert all_of_it.scaled.std(axis=(0, 1)) == pytest.approx([0.1, 2.0], rel=0.02)
    half = Exploration(episodes=20, steps=500, deviation=[0.1, 2.0], seed=1, first=20)
    assert half.noise.tolist() == all_of_it.noise[20:].tolist()
    other = Exploration(episodes=1, steps=500, deviation=[0.1, 2.0], seed=2)
    assert abs(np.corrcoef(other.noise[0, :, 0], all_of_it.noise[0, :, 0])[0, 1]) < 0.2


def test_a_plant_is_told_the_time_since_the_start(nmpc):
    times = []

    def tidal(x, u, rng, t):
        times.append(t)
        return 0.9 * x + 0.5 * u + 0.1 * np.sin(t), float(x[0] ** 2), t == 2 and len(times) > 4

    learn(nmpc, plant=tidal, start=[0.1], episodes=2, steps=4)
    assert times == [0, 1, 2, 3, 0, 1, 2]
    times.clear()
    evaluate(nmpc, nmpc.problem.theta, 3, plant=tidal, start=start)
    env = as_gymnasium(nmpc, plant=tidal, start=[0.1])
    for _ in range(2):
        env.reset(seed=0)
        env.step([0.0])
    assert times == [0, 1, 2, 0, 0]


@pytest.mark.parametrize(
    ("learner", "given", "said"),
    [
        ("GES", {"beta": 1}, r"'alpha'; write learn\(nmpc, \"GES\", .*, alpha=..., beta=...\)"),
        ("QL", {"alpha": "1e-3"}, "alpha = '1e-3' must be a finite number, 0 or more"),
        ("GES", {"alpha": 1, "beta": np.nan}, "beta = nan must be a finite number, 0 or more"),
        ("LSTD", {}, "learner = 'LSTD' is unknown: it must be a Learner, or one of LSTD-Q, QL"),
        ("LSTD-Q", {"episode": 3}, "unexpected keyword argument 'episode'"),
        ("LSTD-Q", {"episodes": 0}, "episodes = 0 must be a whole number, 1 or more"),
        ("LSTD-Q", {"confirm": -1}, "confirm = -1 must be a whole number, 0 or more"),
        ("LSTD-Q", {"deviation": [0.1, 0.2]}, r"deviation = .* must hold 1 numbers, one an input"),
        ("LSTD-Q", {"deviation": -1.0}, "must be a finite number, 0 or more"),
        ("LSTD-Q", {"seed": None}, "seed = None must be a whole number, 0 or more"),
        ("LSTD-Q", {"theta": {"gain": 1.0}}, r"theta = .'gain': 1.0. must .* problem.vector\("),
        ("LSTD-Q", {"data": [1.0]}, r"data = \[1.0\] must have names"),
        ("LSTD-Q", {"data": lambda t: [1.0]}, r"data = \[1.0\] must have names"),
    ],
)
def test_what_cannot_be_learned_is_refused(nmpc, learner, given, said):
    with pytest.raises(ValueError, match=said):
        learn(nmpc, learner, **WORLD, **given)


def test_options_need_a_name_noise_needs_bounds_and_a_resumed_run_has_its_theta(nmpc):
    with pytest.raises(ValueError, match="learner = 'LSTD-Q' takes no every"):
        learn(nmpc, lstd_q(nmpc), every=3, **WORLD)
    free = Nmpc(problem(lower=-np.inf, upper=np.inf), solver="fatrop")
    with pytest.raises(ValueError, match="give deviation=, a number or one an input"):
        learn(free, **WORLD)
    done = learn(nmpc, episodes=1, steps=2, **WORLD)
    with pytest.raises(ValueError, match="leave theta= out"):
        learn(nmpc, theta=[1, 1, 0], resume=done, **WORLD)
    with pytest.raises(ValueError, match=r"write learn\(Nmpc\(problem\), ...\)"):
        learn(problem(), **WORLD)
    with pytest.raises(ValueError, match=r"part is called as part\(k\)"):
        scheduled(q_learning(nmpc, 1e-3), 0.5)
    with pytest.raises(ValueError, match="the run to resume had undo=False"):
        learn(nmpc, undo=True, resume=done, **WORLD)
