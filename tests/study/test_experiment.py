"""An experiment names one run: what it refuses, that it repeats, and what its records say."""

from dataclasses import replace
from importlib import import_module
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.control import Nmpc, SolverError
from nmpcrl.control.codegen import jit
from nmpcrl.study import Experiment, ParameterError, paper, run
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.provenance import key
from nmpcrl.study.records import Records, StepStatus

RUN = import_module("nmpcrl.study.run")  # the module; its name in the package is the function
CLOCKS = {"seconds", "solve_seconds", "fit_seconds"}
DRAWN = ((0.5, 2.2), (3.0, 0.5))
SHORT = {"episodes": 2, "steps": 70, "evaluate_every": 2}  # the networks are ready after 128 steps


def message_of(**fields):
    with pytest.raises(ParameterError) as caught:
        Experiment(**fields)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 300
    return message


POSE = "must be 3 numbers: x in [-3, 9], y in [-3, 9] and a heading in"
LAYOUT = "must be one of A, B, C, D, E, F, or 1 to 16 centres x,y within 100 m of 0"
STEP_SIZE = "must be a number in (0, 1e+06]"
REFUSED = {  # by field: what the sentence says, and values
    "learner": [(f"must be one of {', '.join(LEARNERS)}", "SARSA", None)],
    "seed": [("must be a whole number from 0 to 2147483647", -1, 1.5)],
    "episodes": [("must be a whole number from 1 to 100000", 0, 20.0, 100_000_000)],
    "layout": [(LAYOUT, None, "Z", ((0, 0, 0),), "0,1 2")],
    "decay": [("must be one of step, episode", "year")],
    "decay_rate": [("must be a number in (0, 1]", 0.0, 1.01)],
    "alpha": [(STEP_SIZE, -1e-7), ("arrived as text; write 1.0e-7", "1e-7")],
    "beta": [(STEP_SIZE, -1.0)],
    "zeta": [(STEP_SIZE, 0.0)],
    "beta_tdc": [(STEP_SIZE, 0.0)],
    "network": [("must be one of plain, normalised, tanh, small buffer, four fits", "deep")],
    "box": [("must be one of hard, soft, printed", "open")],
    "theta": [("must be 9 numbers of size at most 1e+06", (1.0,) * 8, (1.0,) * 8 + (1e7,), "1")],
    "steps": [("must be a whole number from 1 to 10000", 0)],
    "start": [(POSE, (9.1, 0, 0))],
    "target": [(POSE, (0, -3.5, 0), (0, 0, 6.3))],
    "horizon": [("must be a whole number from 1 to 500", 0)],
    "solver": [("must be one of riccati, fatrop, ipopt", "acados")],
    "tolerance": [("must be a number in [1e-12, 0.01]", 0.1, 1e-13)],
    "evaluate_every": [("must be a whole number from 1 to 100000", 0)],
}
TRUTHS = ("gated", "clipped", "constrained", "ties_active", "curvature", "projected")
REFUSED |= {name: [("must be true or false", 0, "yes")] for name in TRUTHS}


@pytest.mark.parametrize("name", REFUSED)
def test_a_field_refuses_other_values_in_one_sentence(name):
    for text, *values in REFUSED[name]:
        for value in values:
            message = message_of(**{name: value})
            assert message.startswith(f"{name} = {value!r} {text}")


def test_equal_values_name_the_same_run_and_the_defaults_are_table_is():
    fields = {"seed": np.int64(3), "alpha": np.float64(2e-7), "clipped": np.True_}
    same = Experiment(**fields, theta=np.array(paper.THETA_INIT), layout=np.str_("B"))
    plain = Experiment(seed=3, alpha=2e-7, layout="B")
    assert (same, key(same), type(same.seed)) == (plain, key(plain), int)
    assert len({Experiment(), Experiment(seed=1), Experiment(theta=[*paper.THETA_INIT])}) == 2
    e = Experiment()
    assert (e.episodes, e.steps, e.horizon) == (300, 130, 10)
    assert (e.alpha, e.beta, e.zeta) == (1e-7, 1e-8, 1e-2)
    assert e.theta == (1, 1, 0.05, 0.05, 0.05, 1, 1, 0.1, 0.001)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"start": (5.0, 0.0, 0.0), "box": "printed"}, "start = (5.0, 0.0, 0.0) lies outside the"),
        ({"clipped": False, "constrained": True}, "clipped = False leaves actions"),
        ({"clipped": False, "learner": "QL"}, "clipped = False leaves actions"),
    ],
)
def test_fields_that_do_not_fit_together_are_refused(fields, said):
    assert message_of(**fields).startswith(said)


def test_the_centres_of_a_named_layout_are_that_layout():
    for name, centres in paper.LAYOUTS.items():
        drawn = Experiment(layout=[list(centre) for centre in centres])
        assert (drawn.layout, key(drawn)) == (name, key(Experiment(layout=name)))
    backwards = Experiment(layout=paper.LAYOUTS["A"][::-1])
    assert key(backwards) != key(Experiment())  # sums are made in their order


def test_a_run_among_drawn_obstacles_begins_and_ends_where_it_is_to(tmp_path):
    fields = {"layout": DRAWN, "start": (0, 0, 0), "target": (2, 4, 1.5)}
    records = run(Experiment(learner="frozen", episodes=1, **fields))
    np.testing.assert_array_equal(records.evaluations["states"][0, 0], (0, 0, 0))
    assert Experiment(**fields).task.distance(records.evaluations["states"][-1, -1]) < 0.5
    records.save(tmp_path / "run.npz")
    again = Records.load(tmp_path / "run.npz")
    assert Experiment(**again.experiment) == Experiment("frozen", episodes=1, **fields)


@pytest.fixture(scope="module")
def runs():
    """One short run of each learner."""
    return {name: run(Experiment(learner=name, **SHORT)) for name in LEARNERS}


def same(one, other):
    return all(
        np.array_equal(table[name], beside[name], equal_nan=True)
        for table, beside in ((one.steps, other.steps), (one.evaluations, other.evaluations))
        for name in table
        if name not in CLOCKS
    )


@pytest.mark.parametrize("learner", LEARNERS)
def test_a_run_repeats_to_the_last_bit_and_another_seed_gives_another(runs, learner):
    assert same(run(Experiment(learner, **SHORT)), runs[learner])
    assert not same(run(Experiment(learner, seed=1, **SHORT)), runs[learner])
    np.testing.assert_array_equal(  # the noise is the same, and theta has not moved
        runs[learner].steps["action"][0], runs["ES"].steps["action"][0]
    )


@pytest.mark.parametrize("learner", LEARNERS)
def test_every_step_has_a_row_and_every_column_every_row(runs, learner):
    steps = runs[learner].steps
    np.testing.assert_array_equal(steps["episode"], np.repeat([0, 1], 70))
    np.testing.assert_array_equal(steps["time"], np.tile(np.arange(70), 2))
    assert {len(column) for column in steps.values()} == {140}
    assert runs[learner].facts["stopped"] == "finished"
    assert (steps["status"] == StepStatus.SOLVED).all()
    judged = runs[learner].evaluations["theta"]
    np.testing.assert_array_equal(judged[[0, -1]], [paper.THETA_INIT, steps["theta"][-1]])


@pytest.mark.parametrize("learner", LEARNERS)
def test_the_columns_satisfy_the_papers_equations(runs, learner):
    s = runs[learner].steps
    delta = s["cost"] + 0.97 * s["next_value"] - s["value"]
    np.testing.assert_allclose(s["delta"], delta, rtol=1e-12)
    np.testing.assert_allclose(s["alpha_phi2"], 1e-7 * (s["features"] ** 2).sum(axis=1))
    before = np.vstack([paper.THETA_INIT, s["theta"][:-1]])
    if learner in ("ES", "DES", "RDES"):  # the semi-gradient
        moved = np.nan_to_num(1e-7 * s["delta"])[:, None] * s["features"]
        np.testing.assert_allclose(s["theta"], before + moved, rtol=1e-13)
        assert (s["w"] == 1e-4).all()
    if learner == "GES":  # gradient TD's second equation
        before = np.vstack([np.full(9, 1e-4), s["w"][:-1]])
        overlap = (s["features"] * before).sum(axis=1)
        moved = 1e-8 * (s["delta"] - overlap)[:, None] * s["features"]
        np.testing.assert_allclose(s["w"], before + moved, rtol=1e-12)
    if learner == "frozen":
        assert np.isnan(s["delta"]).all()
        assert (s["theta"] == paper.THETA_INIT).all()


@pytest.mark.parametrize("learner", ["DES", "RDES"])
def test_gated_learners_stand_still_for_127_steps(runs, learner):
    s = runs[learner].steps
    assert np.isnan(s["delta"][:127]).all()
    assert (s["theta"][:127] == paper.THETA_INIT).all()
    assert np.isfinite(s["delta"][127:]).all()
    assert np.isfinite(s["loss"][127:]).all()
    assert (s["theta"][127] != paper.THETA_INIT).any()


def test_read_literally_they_move_from_the_first_step():
    """Towards a network that knows nothing yet: theta_x falls, as departure G says."""
    s = run(Experiment(learner="RDES", gated=False, episodes=1, steps=60)).steps
    assert np.isfinite(s["delta"]).all()
    assert np.isnan(s["loss"]).all()
    assert (s["delta"] < 0).mean() > 0.9
    assert s["theta"][-1, 0] < 0.7


def test_evaluations_come_first_every_so_often_and_last():
    records = run(Experiment(learner="frozen", episodes=5, steps=6, evaluate_every=2))
    np.testing.assert_array_equal(records.evaluations["episode"], [0, 2, 4, 5])
    cost = records.evaluations["cost"]
    assert (cost == cost[0]).all()  # theta does not move, and there is no noise
    assert records.evaluations["states"].shape == (4, 6, 3)


def test_evaluations_do_not_count_as_training_time(monkeypatch):
    """A clock that only runs while a policy is evaluated."""
    now = 0.0

    def slowly(*arguments, **options):
        nonlocal now
        now += 1000.0
        return evaluate(*arguments, **options)

    evaluate = RUN.evaluate
    monkeypatch.setattr(RUN, "evaluate", slowly)
    monkeypatch.setattr(RUN, "time", SimpleNamespace(perf_counter=lambda: now))
    records = run(Experiment(learner="ES", episodes=3, steps=2, evaluate_every=1))
    assert now == 4000.0
    assert records.facts["seconds"] == 0
    assert (records.steps["seconds"] == 0).all()


def test_progress_is_told_after_every_episode():
    told = []
    short = Experiment(learner="ES", episodes=3, steps=4)
    records = run(short, on_episode=lambda *report: told.append(report))
    sums = np.bincount(records.steps["episode"], records.steps["cost"])
    assert [done for done, _ in told] == [1, 2, 3]
    np.testing.assert_allclose([cost for _, cost in told], sums, rtol=1e-12)


@pytest.fixture
def failing(monkeypatch):
    """Makes solves fail where `fails(call)` says so; the calls are counted."""

    def fail(fails):
        solve, calls = Nmpc.solve, count()

        def faulty(self, state, theta, *more, **options):
            if fails(call := next(calls)):
                raise SolverError(f"call {call} failed", state, theta)
            return solve(self, state, theta, *more, **options)

        monkeypatch.setattr(Nmpc, "solve", faulty)

    return fail


def test_failures_and_restarts_are_recorded(failing):
    failing(lambda call: call in (6 + 1, 6 + 4, 6 + 5))  # the second step, and the fourth twice
    records = run(Experiment(learner="frozen", episodes=2, steps=6))
    s = records.steps
    np.testing.assert_array_equal(s["episode"], [0] * 4 + [1] * 6)
    np.testing.assert_array_equal(s["status"], [0, 1, 0, 2] + [0] * 6)
    np.testing.assert_array_equal(s["restarts"], [0, 1, 0, 0] + [0] * 6)
    np.testing.assert_array_equal(np.isnan(s["violation"]), s["status"] == StepStatus.FAILED)
    assert np.isnan(s["features"][3]).all()
    assert np.isnan(s["cost"][3])
    assert np.isnan(s["action"][3]).all()
    assert np.isfinite(s["theta"]).all()
    assert records.facts["stopped"] == "finished"


def test_a_steps_restarts_add_up_and_its_worst_violation_counts(monkeypatch):
    """The first and the second solve of ES, three steps after a rollout of three."""
    restarts = [0, 0, 0] + [0, 1, 2, 2, 0, 0] + [0, 0, 0]
    violation = [0, 0, 0] + [0.3, 0.1, 0.0, 0.2, 0.0, 0.0] + [0, 0, 0]

    solve = Nmpc.solve

    def reporting(*given, **options):
        said = {"restarts": restarts.pop(0), "violation": violation.pop(0)}
        return replace(solve(*given, **options), **said)

    monkeypatch.setattr(Nmpc, "solve", reporting)
    s = run(Experiment(learner="ES", episodes=1, steps=3)).steps
    np.testing.assert_array_equal(s["restarts"], [1, 4, 0])
    np.testing.assert_array_equal(s["violation"], [0.3, 0.2, 0.0])
    assert not restarts


def test_a_run_that_fails_ten_times_in_a_row_says_why_it_stopped(failing):
    failing(lambda call: True)
    records = run(Experiment(learner="ES", episodes=20, steps=6, evaluate_every=4))
    assert records.facts["stopped"].startswith("diverged: 10 episodes in a row")
    np.testing.assert_array_equal(records.steps["episode"], np.arange(10))
    assert (records.evaluations["cost"] == np.inf).all()


@pytest.mark.parametrize("steps", [1, 2, 3, 6])
def test_a_theta_that_explodes_ends_the_run_and_is_not_evaluated(steps):
    records = run(Experiment(learner="ES", episodes=4, steps=steps, alpha=1e5, evaluate_every=1))
    assert records.facts["stopped"].startswith("diverged: theta ")
    assert "left the numbers" in records.facts["stopped"]
    assert len(records.steps["time"]) < 4 * steps
    assert (np.abs(records.evaluations["theta"]) <= 1e6).all()


def test_the_facts_say_which_solver_found_the_plans(monkeypatch):
    short = {"learner": "frozen", "episodes": 1, "steps": 3}
    for name in ("riccati", "fatrop"):
        assert run(Experiment(**short, solver=name)).facts["solver"] == name
    monkeypatch.setattr(jit, "numba_version", lambda: None)
    with pytest.warns(UserWarning, match="fatrop solves instead of riccati"):
        records = run(Experiment(**short))
    assert records.experiment["solver"] == "riccati"
    assert records.facts["solver"] == "fatrop"
