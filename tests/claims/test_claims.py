"""Every claim can have each outcome, and each border is respected exactly."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders import START_COST, quiet_row, timings
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.rows import experiment_of, table
from nmpcrl.analysis.summary import summarise
from nmpcrl.bench.paired import IDLE, Ratio
from nmpcrl.claims import own_claims, thresholds
from nmpcrl.claims.assumptions import LINEAR, SMOOTH, THEOREMS, Measurement, audit, measured
from nmpcrl.claims.paper_claims import BY_RUNS, CLAIMS, WIDER_CLAIMS, WIDER_THAN
from nmpcrl.claims.rule import Observations, judge
from nmpcrl.claims.timing import WAITED, decide
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Assumption, Verdict
from nmpcrl.study import Experiment, Records, Runs, paper, run
from nmpcrl.study.experiment import LEARNERS, PAPER

SEEDS, SOME = range(5), range(2)
ASKED = BY_RUNS | own_claims.OWN_CLAIMS
EVERY = {**CLAIMS, **WIDER_CLAIMS, **own_claims.OWN_CLAIMS}
BAD, SWAYING = {"cost_ratio": 1.6}, {"late_cost_range": 0.06}
LOST = {"final_cost": 500.0, "stopped": "diverged: theta"}
GONE = {"stopped": "diverged: it went"}
FAILED = {"final_cost": np.inf}

Changes = Callable[[Experiment], dict[str, Any]]


def study(
    changes: Changes = lambda _: {}, *, learners=LEARNERS, layouts=("A",), **fields
) -> pd.DataFrame:
    """Runs with both readings and five seeds, quiet but for `changes`."""
    named = [
        Experiment(learner, seed=seed, layout=layout, decay=decay, **fields)
        for learner, layout, decay, seed in product(learners, layouts, ("step", "episode"), SEEDS)
    ]
    return pd.DataFrame([quiet_row(one, **changes(one)) for one in named])


def of(learner: str, seeds=SEEDS, **columns: Any) -> Changes:
    """Changes to the runs of one learner with these seeds, in both readings."""
    return lambda e: columns if learner in (e.learner, "all") and e.seed in seeds else {}


def both(*changes: Changes) -> Changes:
    return lambda e: {name: value for one in changes for name, value in one(e).items()}


def paths(runs: pd.DataFrame, apart: float = 0.0, seeds=SEEDS) -> dict[Experiment, np.ndarray]:
    """Rollouts that stand still, those of RDES with some seeds at a distance [m]."""
    named = [experiment_of(one) for one in runs.to_dict("records")]
    away = {e: apart if e.learner == "RDES" and e.seed in seeds else 0.0 for e in named}
    return {e: np.zeros((3, 3)) + [away[e], 0, 0] for e in named}


def verdict_on(name: str, *observed: Any, **others: Any) -> Verdict:
    """One verdict; the arguments are those of `Observations`."""
    return EVERY[name].judge(Observations(*observed, **others))


def outcomes(runs: pd.DataFrame, rollouts=None) -> dict[str, str]:
    observed = runs, paths(runs) if rollouts is None else rollouts
    return {one.claim: one.outcome for one in judge(ASKED, *observed)}


@pytest.mark.parametrize(
    ("first", "second", "outcome"),
    [
        (SEEDS, (), REPRODUCED), (SOME, (), PARTLY), (SEEDS, SOME, PARTLY),
        ((), (), NOT), (SEEDS, SEEDS, NOT), ((), SEEDS, NOT),
    ],
)  # fmt: skip
@pytest.mark.parametrize(
    ("name", "why"), [("C1", BAD), ("C1", GONE), ("C2", SWAYING), ("C2", BAD), ("C2", GONE)]
)
def test_a_contrast_asks_in_how_many_pairs_only_the_first_went_wrong(
    name, why, first, second, outcome
):
    one, other = EVERY[name].learners
    verdict = verdict_on(name, study(both(of(one, first, **why), of(other, second, **why))))
    assert (verdict.claim, verdict.outcome) == (name, outcome)
    assert verdict.counts["all"] == (2 * len({*first} - {*second}), 10)
    assert [half.counts for half in verdict.own_halves] == [(len(first), len(second))] * 2


def ends(share: float, beyond: float = 0.0) -> dict[str, float]:
    """A final cost that is higher than theta_init's by a share."""
    return {"final_cost": START_COST * (1 + share) + beyond}


BETTER, SAME = thresholds.BETTER, thresholds.SAME_COST
COSTS = [  # the border, and the direction of no
    *(("C5", -SAME, -1), ("C9", -BETTER, 1), ("B1", SAME, 1), ("B2", -BETTER, 1)),
    *(("B3", SAME, 1), ("B3", -SAME, -1), ("B4", SAME, 1)),
]


@pytest.mark.parametrize(
    ("name", "changes", "apart", "outcome"),
    [
        *((name, ends(share), 0.0, REPRODUCED) for name, share, _ in COSTS),
        *((name, ends(share, 1e-9 * no), 0.0, NOT) for name, share, no in COSTS),
        *((name, LOST, 0.0, NOT) for name in ("C5", "C9", "B1")),
        ("C5", {"theta_0": 2.0}, thresholds.SAME_PATH, REPRODUCED),  # theta is not judged
        ("C5", {}, thresholds.SAME_PATH + 1e-9, NOT),
        ("C5", FAILED, np.nan, NOT),
        ("C6", {"imitation_with": thresholds.MORE_ACCURATE}, 0.0, REPRODUCED),
        ("C6", {"imitation_with": np.nextafter(thresholds.MORE_ACCURATE, 1)}, 0.0, NOT),
        ("C6", {"imitation_with": np.nan}, 0.0, UNDECIDABLE),
        ("C7", {"inside_small": 1}, 0.0, PARTLY),  # in training only
        ("C7", {"eval_inside_small": 1, "eval_worst_overlap": 0.005}, 0.0, NOT),
        ("C7", {"eval_worst_overlap": TOUCH}, 0.0, REPRODUCED),
        ("C7", {"inputs": 1}, 0.0, NOT),
        ("C7", {"outside": 1}, 0.0, REPRODUCED),  # the box is another constraint
        ("C9", FAILED, 0.0, NOT),
    ],
)
def test_each_border_belongs_to_yes(name, changes, apart, outcome):
    changed = EVERY[name].learners if name == "C9" else EVERY[name].learners[:1]
    runs = study(both(*(of(learner, **changes) for learner in changed)))
    verdict = verdict_on(name, runs, paths(runs, apart))
    assert (verdict.claim, verdict.outcome) == (name, outcome)
    assert verdict.counts["all"][1] == 10 * len(changed) * (outcome != UNDECIDABLE)
    if outcome == NOT and name not in ("B2", "C9"):  # there, a quiet run is no yes
        some = study(both(*(of(learner, SOME, **changes) for learner in changed)))
        assert verdict_on(name, some, paths(some, apart, SOME)).outcome == PARTLY


def test_robots_are_as_far_apart_as_they_ever_come_whatever_their_headings():
    one, other = np.zeros((2, 4, 3))
    other[2], other[3] = (3.0, 4.0, 0.0), (0.0, 0.0, 9.0)
    assert thresholds.path_distance(one, other) == 5


@pytest.mark.parametrize("learner", sorted(LEARNERS))
def test_the_wider_claim_asks_all_four_learners_what_the_paper_says_of_some(learner):
    runs = study(of(learner, eval_inside_large=9, eval_worst_overlap=0.5, inputs=9))
    assert (verdict_on("C7", runs).outcome == REPRODUCED) == (learner != "RDES")
    assert (verdict_on("W7", runs).outcome == REPRODUCED) == (learner not in PAPER)
    assert verdict_on("W7", runs).by_learner == {one: (10 * (one != learner), 10) for one in PAPER}
    for name, one in WIDER_CLAIMS.items():
        assert {*EVERY[WIDER_THAN[name]].learners} < {*one.learners} == {*PAPER}
        assert not one.quotation
        assert not one.implied


@pytest.mark.parametrize("name", ASKED)
def test_the_learners_of_a_claim_decide_it_and_no_others(name):
    runs = study(lambda e: BAD if e.learner in ("DES", "ES", "matched", "QL") else {})
    asked, rollouts = ASKED[name].learners, paths(runs)
    of_all = verdict_on(name, runs, rollouts)
    alone = verdict_on(name, runs[runs.learner.isin(asked)], rollouts)
    assert (alone.outcome, alone.counts) == (of_all.outcome, of_all.counts)
    for learner in asked:
        some = runs[runs.learner != learner]
        assert verdict_on(name, some, rollouts).outcome == UNDECIDABLE
        cut = pd.concat([some, runs[(runs.learner == learner) & (runs.seed > 0)]])
        asked_once = 20 if name == "C9" else 10  # of C9 each run, of the others each cell
        fewer = verdict_on(name, cut, rollouts)
        assert fewer.counts["all"][1] == asked_once - 2
        assert fewer.missing == 2 or name != "C6"  # it covers the cells of all four learners


@pytest.mark.parametrize(
    ("runs", "rollouts", "open_"),
    [
        (study(episodes=paper.EPISODES - 1), None, {*ASKED}),
        (study(of("all", cost_ratio=np.nan)), None, {"C1", "C2"}),  # no frozen arm
        (study(learners=("frozen",)), None, {*ASKED}),
        (study(learners=PAPER), None, {*own_claims.OWN_CLAIMS}),
        (study(), {}, {"C5"}),
    ],
)
def test_short_runs_and_missing_ones_decide_nothing(runs, rollouts, open_):
    found = outcomes(runs, rollouts)
    assert {name for name, outcome in found.items() if outcome == UNDECIDABLE} == open_


def test_a_run_costs_less_with_the_probability_that_counts_every_pair_alike():
    runs = study(of("TDC", final_cost=900.0))
    assert own_claims.costs_less(runs, "TDC", "GES").value == 1
    assert own_claims.costs_less(runs, "GES", "TDC").value == 0
    assert np.isnan(own_claims.costs_less(runs, "TDC", "none").value)
    numbers = verdict_on("B1", runs).numbers
    assert (numbers["better"].value, numbers["second"]) == (1, 0)
    assert numbers["first"] == pytest.approx(0.1)
    assert verdict_on("B1", runs[runs.learner != "GES"]).numbers == {}


@pytest.mark.parametrize(
    ("columns", "diverged", "unstable"),
    [
        ({"cost_ratio": thresholds.DIVERGED}, False, False),
        ({"cost_ratio": np.nextafter(thresholds.DIVERGED, 2)}, True, True),
        ({"cost_ratio": np.inf}, True, True),
        ({"cost_ratio": 0.1, "stopped": "diverged: theta"}, True, True),
        ({"cost_ratio": np.nan, "stopped": "diverged: theta"}, True, True),
        ({"cost_ratio": np.nan}, pd.NA, pd.NA),
        ({"late_cost_range": thresholds.UNSTABLE}, False, False),
        ({"late_cost_range": np.nextafter(thresholds.UNSTABLE, 1)}, False, True),
        ({"late_cost_range": np.inf}, False, True),
    ],
)
def test_stopped_runs_and_costs_above_a_border_are_divergence_and_instability(
    columns, diverged, unstable
):
    runs = study(of("DES", **columns), learners=("DES",))
    assert thresholds.divergence(runs).unique().tolist() == [diverged]
    assert thresholds.instability(runs).unique().tolist() == [unstable]


def test_records_are_judged_as_the_rows_of_their_summaries():
    found, done, lost = {}, "finished", "diverged: w"
    cases = [(1, 0, 1, done), (10, 0, 1, done), (10, 0, 3, done), (1, 3, 3, done), (1, 0, 0, lost)]
    for seed, (factor, late, late_arm, end) in enumerate(cases):  # late episodes are cut short
        for name, *changes in (("ES", factor, late, end), ("frozen", 1, late_arm, done)):
            times, cut, stopped = changes
            records = run(one := Experiment(name, seed=seed, episodes=6, steps=6))
            status = np.where(records.steps["episode"] >= 6 - cut, 2, records.steps["status"])
            steps = records.steps | {"status": status, "cost": records.steps["cost"] * times}
            found[one] = replace(records, steps=steps, facts=records.facts | {"stopped": stopped})
    rows = table({e: summarise(records) for e, records in found.items()})
    short = thresholds.of_records(Runs(found))
    for wrong in (thresholds.divergence, thresholds.instability):
        assert wrong(short).tolist() == wrong(rows).tolist()
        assert {True, False} <= {*wrong(short)}
    es = thresholds.divergence(short[short.learner == "ES"])
    assert es.tolist() == [False, True, False, pd.NA, True]


def test_the_share_achieved_is_1_at_the_possible_cost_0_at_theta_init_and_negative_beyond():
    costs = [80.0, 100.0, 90.0, 120.0, np.inf, 90.0, 90.0, 90.0]
    runs = pd.DataFrame({"layout": ["A"] * 6 + ["B", "C"], "initial_cost": 100.0})
    runs = runs.assign(final_cost=costs, stopped="finished")
    runs.loc[5, "stopped"] = "diverged: it went"
    shares = thresholds.share_of_possible(runs, {"A": 0.2, "B": 0.0})
    worst = [-np.inf, -np.inf]
    np.testing.assert_allclose(shares, [1.0, 0.0, 0.5, -1.0, *worst, np.nan, np.nan], atol=1e-12)


@pytest.mark.parametrize(
    ("pairs", "counts", "as_claimed", "against", "p"),
    [
        ([(2, 2)] * 10, (10, 10), 0, 0, 1.0),
        ([(2, 1)] * 4, (4, 0), 4, 0, 0.125),
        ([(1, 2)] * 4 + [(2, 2)], (1, 5), 0, 4, 0.125),
        ([(2, 1), (1, np.inf), (2, np.nan)], (1, 1), 1, 1, 1.0),
    ],
)
def test_only_pairs_that_differ_tell_the_learners_apart(pairs, counts, as_claimed, against, p):
    cells = [("A", decay, seed) for decay in ("step", "episode") for seed in range(len(pairs))]
    index = pd.MultiIndex.from_tuples(cells, names=["layout", "decay", "seed"])
    values = pd.DataFrame(pairs * 2, index, columns=["DES", "RDES"])
    found = [*BY_RUNS["C1"].split(values)]
    ways = [*product(("diverged", "had to be stopped"), ("step", "episode"))]
    assert [(one.wrong, one.decay) for one in found] == ways
    for one in found[:2]:
        assert (one.counts, one.pairs) == (counts, len(values.dropna()) / 2)
        assert (one.as_claimed, one.against) == (as_claimed, against)
        assert one.p == pytest.approx(p)
    assert sum(found[2].counts) == np.isinf(values).to_numpy().sum() / 2


CLAIMED, NEAR = (0.9, 1.1), (0.8, 1.25)


@pytest.mark.parametrize(
    ("low", "high", "waited", "expected"),
    [
        (0.9, 1.1, 0, REPRODUCED),
        (0.9, 1.1, WAITED, REPRODUCED),
        (0.9, 1.1, WAITED + 0.01, UNDECIDABLE),
        (0.8, 0.89, 0, PARTLY),
        (1.11, 1.249, IDLE + 0.01, PARTLY),
        (0.85, 1.2, 0, UNDECIDABLE),  # near on both sides, and as claimed between them
        (0.5, 0.79, 0, NOT),
        (1.25, 2.0, 0, NOT),
        (np.nan, np.nan, 0, UNDECIDABLE),
    ],
)
def test_an_interval_on_one_side_of_every_border_decides(low, high, waited, expected):
    assert decide(Ratio((low + high) / 2, low, high, waited), CLAIMED, NEAR) == expected


@given(st.tuples(st.floats(0.5, 1.6), st.floats(0.5, 1.6)).map(sorted), st.floats(0, 1))
def test_the_outcome_of_an_interval_is_that_of_every_number_in_it(ends, at):
    low, high = ends
    value = min(max(low + at * (high - low), low), high)
    one, every = (decide(Ratio(value, *of, 0), CLAIMED, NEAR) for of in ((value,) * 2, ends))
    assert every in (one, UNDECIDABLE)


@pytest.mark.parametrize(
    ("name", "given_", "outcome"),
    [
        ("C3", {"rdes": 0.39}, PARTLY), ("C3", {"rdes": 0.4}, REPRODUCED),
        ("C3", {"rdes": 0.6}, REPRODUCED), ("C3", {"rdes": 1.0}, NOT),
        ("C3", {"rdes": 0.62, "width": 0.01}, PARTLY),
        ("C3", {"rdes": 0.62, "width": 0.03}, UNDECIDABLE),
        ("C3", {"solvers": ("fatrop",)}, UNDECIDABLE), ("C3", {"solvers": ()}, UNDECIDABLE),
        ("C4", {"ges": 0.79}, NOT), ("C4", {"ges": 0.9}, REPRODUCED),
        ("C4", {"ges": 1.1}, REPRODUCED), ("C4", {"ges": 1.2}, PARTLY), ("C4", {"ges": 1.25}, NOT),
    ],
)  # fmt: skip
def test_claims_about_time_are_decided_with_the_paper_s_solver(name, given_, outcome):
    taken = timings(**given_)
    verdict = verdict_on(name, timings=taken)
    assert (verdict.claim, verdict.outcome) == (name, outcome)
    if "ipopt" in given_.get("solvers", ["ipopt"]):
        assert list(verdict.numbers) == ["ipopt", "fatrop"]
        assert verdict.ratio == verdict.numbers["ipopt"].value
    assert verdict_on(name, timings=taken[:1]).outcome == UNDECIDABLE  # ES alone


@pytest.mark.parametrize(
    ("holds", "outcome"),
    [
        ({(SMOOTH, LINEAR): True, (SMOOTH,): True}, REPRODUCED),
        ({(SMOOTH, LINEAR): True, (SMOOTH,): False}, REPRODUCED),  # the other one applies
        ({(SMOOTH, LINEAR): False, (SMOOTH,): True}, NOT),
        ({(LINEAR,): False, (SMOOTH,): False}, NOT),
        ({(LINEAR,): False}, NOT),  # of the other theorem nothing is known
        ({}, UNDECIDABLE),
    ],
)
def test_c8_needs_every_assumption_of_one_theorem(holds, outcome):
    made = tuple(Assumption(f"{by}", "so", holds=one, by=by) for by, one in holds.items())
    verdict = verdict_on("C8", assumptions=made)
    assert (verdict.claim, verdict.outcome, verdict.assumptions) == ("C8", outcome, made)


SMOOTH_VALUE = "the value is three times differentiable in theta"
FASTER = "w moves faster than theta, alpha / beta to 0"
GRADIENT = "the update follows the gradient of the MSPBE, curvature included"


@pytest.mark.parametrize(
    ("beta", "found", "holding"),
    [
        (1e-7, Measurement(0.1, 0.5, 0.1), {}),
        (2e-7, Measurement(0.1, 0.5, 0.1), {FASTER: THEOREMS}),
        (1e-8, Measurement(0.0, 0.5, 0.1), {SMOOTH_VALUE: (SMOOTH,)}),
        (1e-8, Measurement(0.1, 0.5, 0.0), {GRADIENT: (SMOOTH,)}),
    ],
)
def test_settings_and_measurements_can_meet_three_assumptions_of_nine(beta, found, holding):
    made = audit(Experiment("GES", beta=beta), found)
    assert {one.theorem: one.by for one in made if one.holds} == holding
    assert len(made) == 9


@pytest.mark.parametrize("on_boundary", [False, True])
def test_the_audit_measures_kinks_memory_and_the_dropped_term(on_boundary):
    touching = (0.5, 2.2 - 1.25 * np.sqrt(1 + paper.THETA_INIT[-1]), 0.0)  # layout A
    steps = {
        "state": np.array([touching if on_boundary else (-2.0, -2.0, 0.0)] * 4),
        "theta": np.tile(paper.THETA_INIT, (4, 1)),
        "delta": np.array([1.0, 2.0, 3.0, 4.0]),
    }
    records = Records({"theta": paper.THETA_INIT}, steps, {}, {})
    found = measured(Experiment("GES"), records, pd.DataFrame({"ratio": [0.25]}))
    assert (found.kinks, found.dropped) == (on_boundary, 0.25)
    assert found.memory == pytest.approx(1)
