"""The runs in drawn layouts: their parts, and answers to evidence that is made up."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.rows import FIELDS, OUTCOME, as_text
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS, WIDER_CLAIMS
from nmpcrl.claims.rule import Observations
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies import population
from nmpcrl.studies.difficulty import MEASURES, PILOT
from nmpcrl.studies.population import EXPECTED, JUDGED, PARTS, POPULATION, seed_of
from nmpcrl.study.drawn import JUDGE, LAYOUTS
from nmpcrl.study.experiment import MAIN, Experiment, frozen_arm

NAMES = [*JUDGE][:20]
FAILING = NAMES[:4]
BOTH = ("step", "episode")


def made(part, learner, name, *, better=True, decay="step", **numbers):
    """The row of a run that ends 5 % better than theta_init, or as much worse."""
    own = {"horizon": int(part[4:])} if part.startswith("N") else {}
    one = Experiment(learner, layout=LAYOUTS[name], decay=decay, seed=seed_of(name, 0), **own)
    row = {field: as_text(getattr(one, field)) for field in FIELDS}
    row |= dict.fromkeys(OUTCOME, 0.0) | {"stopped": "finished", "initial_cost": 100.0}
    row |= {"final_cost": 95.0 if better else 105.0, "cost_ratio": 1.0, "part": part}
    row |= {"imitation_with": 1.0, "imitation_without": 2.0, "moved": np.nan, "worth": np.nan}
    return row | {"delta_first": 2.0, "delta_last": 1.0} | numbers


def judged(**numbers):
    """All learners of the main table; each fails in `FAILING`."""
    return pd.DataFrame(
        made("judge", learner, name, better=name not in FAILING, decay=decay, **numbers)
        for learner in MAIN for name in NAMES for decay in BOTH
    )  # fmt: skip


def shares(runs):
    names = runs[["learner", "layout", "decay", "seed"]].to_dict("records")
    paths = {Experiment(**one): np.zeros((130, 3)) for one in names}
    return population.shares(population.by_layout(runs, paths)).set_index("claim")


@pytest.fixture(scope="module")
def measures():
    """The gap closes early where learning fails, and the other measures are noise."""
    rng = np.random.default_rng(0)
    found = pd.DataFrame(rng.normal(size=(len(LAYOUTS), len(MEASURES))), [*LAYOUTS], [*MEASURES])
    return found.assign(**{PILOT: [0.1 if n in (*FAILING, "T01") else 0.6 for n in found.index]})


@pytest.fixture(scope="module")
def drawn():
    return population.load()


def test_each_run_has_its_counterparts_and_a_claim_holds_where_most_answers_are_yes():
    plan = {part: population.experiments(pd.DataFrame([*POPULATION.conditions(part)]))
            for part in PARTS}  # fmt: skip
    every = {e for runs in plan.values() for e in runs}
    assert len(every) == sum(map(len, plan.values())) == 3720
    assert all(frozen_arm(one) in every for one in every)
    judged = [one for part in JUDGED for one in plan[part]]
    assert len(judged) == len(MAIN) * 120 * 2 * 2
    cells = {(one.learner, one.layout, one.decay, one.seed) for one in judged}
    others = [one for part, runs in plan.items() if part[0] in "Na" for one in runs]
    assert {(one.learner, one.layout, one.decay, one.seed) for one in others} <= cells
    seeds = [seed_of(name, k) for name in LAYOUTS for k in (0, 1)]
    assert len({*seeds}) == len(seeds)
    cells = [("J001", "step", True), ("J001", "episode", False)]
    cells += [("J002", "step", True), ("J002", "episode", True)]
    rows = [made("judge", "ES", name, decay=decay, better=yes) for name, decay, yes in cells]
    where = population.by_layout(pd.DataFrame(rows), {})
    assert where[["claim", "layout", "yes", "of", "holds"]].to_numpy().tolist() == [
        ["ES improves", "J001", 1, 2, False], ["ES improves", "J002", 2, 2, True],
    ]  # fmt: skip


def test_shares_count_layouts_and_every_claim_on_the_main_table_has_an_expected_one():
    found = shares(judged())
    claims = {**BY_RUNS, **WIDER_CLAIMS, **OWN_CLAIMS}
    decided = {name for name, claim in claims.items() if {*claim.learners} <= {*MAIN}}
    alone = {f"{learner} improves" for learner in MAIN if learner != "frozen"}
    assert {*found.index} == {*EXPECTED} == decided | alone
    assert found.loc["C9", ["holding", "layouts", "outcome", "within"]].tolist() == [
        16, 20, PARTLY, True,
    ]  # fmt: skip
    assert found.loc["C9", "low"] < 0.8 < found.loc["C9", "high"]
    assert found.holding[["C6", "C5"]].tolist() == [20, 20]  # all paths are the same
    assert found.loc["C2", "outcome"] == NOT


@pytest.mark.parametrize(("overlap", "outcome"), [(0.0, PARTLY), (0.5, NOT)])
def test_a_weaker_question_counts_in_drawn_layouts_as_it_does_in_a_to_f(overlap, outcome):
    runs = judged(inside_small=1.0, eval_worst_overlap=overlap)
    found = shares(runs)
    for claim, verdict in (("C7", BY_RUNS["C7"]), ("W7", WIDER_CLAIMS["W7"])):
        assert found.loc[claim, "holding"] == 0
        assert found.loc[claim, "outcome"] == outcome
        assert verdict.settled(Observations(runs)).outcome == outcome


def test_the_measure_that_tells_success_is_ahead_of_noise_and_both_halves_confirm_gaps(measures):
    tuned = [made("tune", "ES", n, better=n != "T01") for n in LAYOUTS if n[0] == "T"]
    runs = pd.concat([judged(), pd.DataFrame(tuned)], ignore_index=True)
    assert [*(yes := population.succeeds(runs[runs.part == "judge"])).index[~yes]] == FAILING
    answer = population.predictors(population.Drawn(runs, {}, measures))
    assert answer.outcome in (REPRODUCED, PARTLY)
    assert 0 < answer.numbers["cost"] < 1
    runs["final_cost"] = 95.0  # none fails
    assert population.predictors(population.Drawn(runs, {}, measures)).outcome == UNDECIDABLE
    success = population.succeeds(judged())
    answer = population.closing_gaps(measures, success)
    assert [*answer.counts.values()] == [(4, 4), (16, 16)]
    assert (answer.outcome, answer.words) == (REPRODUCED, "confirmed")
    assert population.closing_gaps(measures, success | True).outcome == NOT


def test_the_same_gap_closes_up_to_a_step_of_the_grid_and_a_cliff_costs_half():
    stops = pd.DataFrame({10: [0.2, 0.2, np.nan, 0.1], 20: [0.25, 0.4, 0.1, np.nan], 40: 0.2})
    assert population.gaps_and_horizon(stops).counts == {"layouts the same": (1, 3)}
    answer = population.cliff(pd.Series({"A": 0.0, "B": 0.6, "C": 1.4, "D": 0.1}))
    assert (answer.counts, answer.numbers) == ({"layouts": (2, 4)}, {"most": 1.4})


@pytest.mark.parametrize(
    ("whole", "words"), [([3, 4], "found by search"), ([3, 3], "contradicted")]
)
def test_a_setting_that_is_searched_for_confirms_nothing(whole, words):
    assert population.whole_picture(pd.DataFrame({"whole": whole})).words == words
