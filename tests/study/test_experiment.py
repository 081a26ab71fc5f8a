"""An experiment names one run: refused values, repetition, and the records of its run."""

from dataclasses import replace
from importlib import import_module
from itertools import count, product

import numpy as np
import pytest
from builders import assert_same_numbers

from nmpcrl.control import Nmpc, SolverError
from nmpcrl.learning.episode import Loop
from nmpcrl.study import Experiment, ParameterError, paper, run
from nmpcrl.study.design import FIELDS
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.parameters import shown
from nmpcrl.study.provenance import key
from nmpcrl.study.records import StepStatus

RUN = import_module("nmpcrl.study.run")  # the module; its name in the package is the function
SHORT = {"episodes": 2, "steps": 70, "evaluate_every": 2}  # the networks are ready after 128 steps


REFUSED = [  # fields, and values just beyond what is allowed
    (("learner", "decay", "network", "box", "solver"), ("other", None, ["ES"])),
    (("gated", "clipped", "constrained", "ties_active", "curvature", "projected"), (1, "true")),
    (("alpha", "beta", "zeta", "beta_tdc"), (-1e-7, 0.0, 1.1e6, np.nan, True, "0.5")),
    (("decay_rate",), (0.0, 1.01)),
    (("seed",), (-1, 1.5, 2**31, True, "3")),
    (("episodes", "evaluate_every"), (0, 20.0, 100_001)),
    (("steps",), (0, 10_001)),
    (("horizon",), (0, 501)),
    (("tolerance",), (0.1, 1e-13)),
    (("layout",), (None, "Z", ((0, 0, 0),), "0,1 2", (), ((1, 2),) * 17, ((0, 101),))),
    (("theta",), ((1.0,) * 8, (1.0,) * 8 + (1.1e6,), "1", ("1",) * 9)),
    (("start", "target"), ((9.1, 0, 0), (0, -3.5, 0), (0, 0, 6.3))),
]


def message_of(**fields):
    with pytest.raises(ParameterError) as caught:
        Experiment(**fields)
    return str(caught.value)


@pytest.mark.parametrize(("names", "values"), REFUSED)
def test_a_field_refuses_other_values_in_one_sentence(names, values):
    for name, value in product(names, values):
        assert message_of(**{name: value}) == f"{name} = {shown(value)} must be {FIELDS[name].text}"


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


@pytest.fixture(scope="module")
def runs():
    """One short run of each learner."""
    return {name: run(Experiment(learner=name, **SHORT)) for name in LEARNERS}


@pytest.mark.parametrize("learner", LEARNERS)
def test_a_run_repeats_to_the_last_bit_and_another_seed_gives_another(runs, learner):
    assert_same_numbers(run(Experiment(learner, **SHORT)), runs[learner])
    other = run(Experiment(learner, seed=1, **SHORT)).steps
    assert (other["action"] != runs[learner].steps["action"]).any(axis=1).all()


@pytest.mark.parametrize("learner", LEARNERS)
def test_every_step_has_a_row_and_every_column_every_row(runs, learner):
    steps, judged = runs[learner].steps, runs[learner].evaluations["theta"]
    np.testing.assert_array_equal(steps["episode"], np.repeat([0, 1], 70))
    np.testing.assert_array_equal(steps["time"], np.tile(np.arange(70), 2))
    assert {len(column) for column in steps.values()} == {140}
    assert (runs[learner].facts["stopped"], *set(steps["status"])) == ("finished", 0)
    np.testing.assert_array_equal(judged[[0, -1]], [paper.THETA_INIT, steps["theta"][-1]])
    np.testing.assert_array_equal(steps["action"][0], runs["ES"].steps["action"][0])  # same noise


@pytest.mark.parametrize("learner", LEARNERS)
def test_the_td_error_and_the_size_of_a_step_are_those_of_its_columns(runs, learner):
    s = runs[learner].steps
    delta = s["cost"] + 0.97 * s["next_value"] - s["value"]
    np.testing.assert_allclose(s["delta"], delta, rtol=1e-12)
    np.testing.assert_allclose(s["alpha_phi2"], 1e-7 * (s["features"] ** 2).sum(axis=1))
    if learner == "frozen":
        assert np.isnan(s["delta"]).all()
        assert (s["theta"] == paper.THETA_INIT).all()


def test_evaluations_come_first_every_so_often_and_last_and_each_episode_is_reported():
    reported, e = [], Experiment(learner="frozen", episodes=5, steps=6, evaluate_every=2)
    records = run(e, on_episode=lambda *report: reported.append(report))
    np.testing.assert_array_equal(records.evaluations["episode"], [0, 2, 4, 5])
    cost = records.evaluations["cost"]
    assert (cost == cost[0]).all()  # theta does not move, and there is no noise
    assert records.evaluations["states"].shape == (4, 6, 3)
    sums = np.bincount(records.steps["episode"], records.steps["cost"])
    np.testing.assert_allclose(reported, np.column_stack([range(1, 6), sums]), rtol=1e-12)


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
        monkeypatch.setattr(Loop, "of", lambda _: None)

    return fail


def test_failures_restarts_and_the_worst_violation_of_a_step_are_recorded(failing, monkeypatch):
    failing(lambda call: call == 6 + 3)  # the fourth step, after a rollout of six
    records = run(Experiment(learner="frozen", episodes=2, steps=6))
    s = records.steps
    np.testing.assert_array_equal(s["episode"], [0] * 4 + [1] * 6)
    np.testing.assert_array_equal(s["status"], [0, 0, 0, 2] + [0] * 6)
    for name in ("violation", "features", "cost", "action"):
        missing = np.isnan(s[name]).reshape(10, -1)
        assert (missing.all(axis=1) == (s["status"] == StepStatus.FAILED)).all()
    assert np.isfinite(s["theta"]).all()
    assert records.facts["stopped"] == "finished"
    restarts = [0, 0, 0] + [0, 1, 2, 2, 0, 0] + [0, 0, 0]
    violation = [0, 0, 0] + [0.3, 0.1, 0.0, 0.2, 0.0, 0.0] + [0, 0, 0]

    solve = Nmpc.solve

    def reporting(*given, **options):
        said = {"restarts": restarts.pop(0), "violation": violation.pop(0)}
        return replace(solve(*given, **options), **said)

    monkeypatch.setattr(Nmpc, "solve", reporting)
    monkeypatch.setattr(Loop, "of", lambda _: None)
    s = run(Experiment(learner="ES", episodes=1, steps=3)).steps
    np.testing.assert_array_equal(s["restarts"], [1, 4, 0])
    np.testing.assert_array_equal(s["status"], [1, 1, 0])
    np.testing.assert_array_equal(s["violation"], [0.3, 0.2, 0.0])
    assert not restarts


@pytest.mark.parametrize("steps", [1, 2, 3, 6])
def test_a_theta_that_explodes_ends_the_run_and_is_not_evaluated(steps):
    records = run(Experiment(learner="ES", episodes=4, steps=steps, alpha=1e5, evaluate_every=1))
    assert records.facts["stopped"].startswith("diverged: theta ")
    assert "left the numbers" in records.facts["stopped"]
    assert len(records.steps["time"]) < 4 * steps
    assert (np.abs(records.evaluations["theta"]) <= 1e6).all()
