"""What the population answers, from evidence that is made up, so that every answer is known."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.difficulty import MEASURES, OPEN, PILOT
from nmpcrl.analysis.rows import FIELDS, OUTCOME, as_text
from nmpcrl.claims import population
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.population_questions import EXPECTED, QUESTIONS
from nmpcrl.claims.rule import Observations
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.claims.wider_claims import WIDER_CLAIMS
from nmpcrl.study.drawn import JUDGE, LAYOUTS, TUNE
from nmpcrl.study.experiment import MAIN, Experiment
from nmpcrl.study.population_design import COMPARED, seeds

NAMES = [*JUDGE][:20]
FAILING = NAMES[:4]
PATH = np.zeros((130, 3))


def made(part, learner, name, *, better=True, seed=0, decay="step", **numbers):
    """The row of a run that ends 5 % better than theta_init, or as much worse."""
    own = {"horizon": int(part[4:])} if part.startswith("N") else {}
    experiment = Experiment(
        learner=learner, layout=LAYOUTS[name], decay=decay, seed=seeds(name)[seed], **own
    )
    row = {one: as_text(getattr(experiment, one)) for one in FIELDS}
    row |= dict.fromkeys(OUTCOME, 0.0) | {"stopped": "finished", "initial_cost": 100.0}
    row |= {"final_cost": 95.0 if better else 105.0, "cost_ratio": 1.0, "part": part}
    row |= {"imitation_with": 1.0, "imitation_without": 2.0, "moved": np.nan, "worth": np.nan}
    row |= {"delta_first": 2.0, "delta_last": 1.0}
    return row | numbers


def table(rows):
    return pd.DataFrame(rows)


def judged(part="judge", **numbers):
    """All learners of the main table; each fails in `FAILING`."""
    return [
        made(part, learner, name, better=name not in FAILING, decay=decay, **numbers)
        for learner in MAIN
        for name in NAMES
        for decay in ("step", "episode")
    ]


def paths(runs):
    return {
        Experiment(
            learner=row["learner"], layout=row["layout"], decay=row["decay"], seed=row["seed"]
        ): PATH
        for row in runs
    }


@pytest.fixture(scope="module")
def difficulty():
    """The gap closes early where learning fails, and the other measures are noise."""
    rng = np.random.default_rng(0)
    found = pd.DataFrame(rng.normal(size=(len(LAYOUTS), len(MEASURES))), [*LAYOUTS], [*MEASURES])
    found[PILOT] = [0.1 if name in FAILING or name == "T01" else 0.6 for name in found.index]
    return found


def test_a_claim_holds_in_a_layout_where_more_than_half_of_its_answers_are_yes():
    rows = [
        made("judge", "ES", "J001", better=one, decay=decay)
        for one, decay in ((True, "step"), (False, "episode"))
    ]
    rows += [made("judge", "ES", "J002", decay=decay) for decay in ("step", "episode")]
    where = population.held(table(rows), {}, ["ES improves"]).set_index("layout")
    assert where.loc["J001", ["yes", "of", "holds"]].tolist() == [1, 2, False]
    assert where.loc["J002", ["yes", "of", "holds"]].tolist() == [2, 2, True]


def test_shares_count_layouts_and_never_runs():
    runs = judged()
    found = population.shares(population.held(table(runs), paths(runs))).set_index("claim")
    assert {*found.index} == {*EXPECTED}
    assert found.loc["C9", ["holding", "layouts"]].tolist() == [16, 20]
    assert found.loc["C9", "outcome"] == PARTLY
    assert found.loc["C9", "within"]
    assert found.loc["C6", "holding"] == 20
    assert found.loc["C5", "holding"] == 20  # all paths are the same
    assert found.loc["C2", "outcome"] == NOT
    assert found.loc["C9", "low"] < 0.8 < found.loc["C9", "high"]


@pytest.mark.parametrize(
    ("without_noise", "outcome"), [(0.0, PARTLY), (0.5, NOT)], ids=["kept", "not kept"]
)
def test_a_weaker_question_counts_in_drawn_layouts_as_it_does_in_a_to_f(without_noise, outcome):
    runs = judged(inside_small=1.0, eval_worst_overlap=without_noise)
    found = population.shares(population.held(table(runs), paths(runs))).set_index("claim")
    for claim, verdict in zip(("C7", "W7"), (BY_RUNS["C7"], WIDER_CLAIMS["W7"]), strict=True):
        assert found.loc[claim, "holding"] == 0
        assert found.loc[claim, "outcome"] == outcome
        assert verdict.settled(Observations(table(runs))).outcome == outcome


def test_a_claim_whose_learners_are_not_there_yet_is_not_asked():
    runs = [row for row in judged() if row["learner"] in ("frozen", "ES")]
    where = population.held(table(runs), {})
    assert {*where.claim} == {"ES improves"}


def test_the_measure_that_tells_success_is_ahead_of_noise(difficulty):
    success = population.succeeds(table(judged()))
    assert [*success.index[~success]] == FAILING
    tuned = pd.Series({name: name != "T01" for name in LAYOUTS if name[0] == "T"})
    scores = population.predictor_scores(difficulty, tuned, success)
    assert scores.auc[PILOT].value == 1
    assert scores.ahead[PILOT].value == 0
    assert scores.brier[PILOT].value < scores.brier["cost"].value
    answer = population.predictors(scores)
    assert answer.outcome in (REPRODUCED, PARTLY)
    assert answer.numbers["cost"] == 1 - scores.auc["cost"].value


def test_without_a_failure_no_predictor_is_ahead(difficulty):
    tuned = pd.Series({name: name != "T01" for name in LAYOUTS if name[0] == "T"})
    success = pd.Series(dict.fromkeys(NAMES, True))
    answer = population.predictors(population.predictor_scores(difficulty, tuned, success))
    assert answer.outcome == UNDECIDABLE


def test_closing_gaps_is_confirmed_by_both_halves_only(difficulty):
    success = population.succeeds(table(judged()))
    answer = population.closing_gaps(difficulty, success)
    assert answer.counts == {
        "layouts fail where it closes": (4, 4),
        "layouts succeed elsewhere": (16, 16),
    }
    assert answer.outcome == REPRODUCED
    assert answer.words == "confirmed"
    never = pd.Series(dict.fromkeys(NAMES, True))
    assert population.closing_gaps(difficulty, never).outcome == NOT


def test_a_longer_horizon_is_asked_for_where_the_short_one_fails():
    names = [*COMPARED][:8]
    rows = [made("judge", "ES", name, better=name == names[0]) for name in names]
    for part in ("N = 20", "N = 40"):
        helped = part == "N = 40"
        rows += [made(part, "ES", n, better=helped and n == names[1]) for n in names]
    answer = population.horizon(table(rows))
    assert answer.counts == {"layouts still fail": (6, 7)}


def test_the_same_gap_closes_at_the_same_theta_c_up_to_a_step_of_the_grid():
    stops = pd.DataFrame({10: [0.2, 0.2, np.nan, 0.1], 20: [0.25, 0.4, 0.1, np.nan]})
    answer = population.gaps_and_horizon(stops.assign(**{"40": 0.2}).rename(columns={"40": 40}))
    assert answer.counts == {"layouts the same": (1, 3)}


def test_the_trap_is_asked_of_the_runs_that_do_not_arrive():
    rows = [made("judge", "ES", name, distance=0.1) for name in NAMES]
    rows += [
        made("judge", "ES", name, decay="episode", better=False, distance=5, moved=0.0, worth=0.9)
        for name in FAILING
    ]
    rows[-1] |= {"worth": 1.1, "delta_last": 3.0}
    stands, worse = population.trap(table(rows))
    assert stands.counts == worse.counts == {"layouts": (3, 4), "runs": (3, 4)}


def test_early_overshoot_is_of_the_runs_that_were_stopped():
    stopped = {"stopped": "diverged: theta", "over": 0.01, "steps_done": 10 * 130}
    rows = [made("judge", "RDES", name, decay="episode", **stopped) for name in NAMES]
    rows += [made("judge", "RDES", name, decay="step") for name in NAMES]
    answer = population.early_overshoot(table(rows))
    assert answer.outcome == REPRODUCED
    assert answer.beside == {"runs stopped": (20, 20)}
    late = [row | {"steps_done": 100 * 130} for row in rows]
    assert population.early_overshoot(table(late)).outcome == NOT


def test_every_answer_is_to_a_question(difficulty):
    tuned = [made("tune", "ES", name, better=name != "T01") for name in TUNE]
    runs = judged() + tuned
    runs += [made(f"N = {n}", "ES", name) for n in (20, 40) for name in COMPARED]
    stops = pd.DataFrame({n: [0.2] for n in (10, 20, 40)})
    found = population.answers(table(runs), difficulty, stops)
    assert {one.question for one in found} <= {*QUESTIONS}


def test_a_cliff_is_where_a_little_more_theta_c_costs_half():
    answer = population.cliff(pd.Series({"A": 0.0, "B": 0.6, "C": 1.4, "D": 0.1}))
    assert answer.counts == {"layouts": (2, 4)}
    assert answer.numbers["most"] == 1.4


def test_extrapolation_is_asked_of_the_runs_that_are_stopped_without_an_intervention():
    rows = [("A", 0, "none", True), ("A", 1, "none", False), ("B", 0, "none", True)]
    rows += [("A", 0, "theta held", True), ("A", 1, "theta held", True)]
    rows += [("B", 0, "theta held", False), ("A", 0, "true slope", False)]
    compared = pd.DataFrame(rows, columns=["layout", "seed", "intervention", "stopped"])
    assert population.extrapolation(compared).counts == {"survive, theta held": (1, 2)}
    slope = population.extrapolation(compared, "true slope")
    assert slope.counts == {"survive, true slope": (1, 1)}


def test_of_open_and_closed_gaps_only_runs_where_there_is_one_are_counted():
    ends = [("J001", 0.3, 0.2, True), ("J002", 0.1, 0.2, False), ("J003", OPEN, 1.2, True)]
    rows = [made("judge", "ES", name, better=one, theta_8=c) for name, _, c, one in ends]
    rows.append(made("judge", "ES", "J001", final_cost=99.5, theta_8=0.2))
    closes = pd.DataFrame({PILOT: {name: closed for name, closed, *_ in ends}})
    found = population.at_the_gap(table(rows), closes)
    assert found.gap.tolist() == [True, True, False, True]
    assert population.improve_by_gap(found) == {"open": (1, 2), "closed": (0, 1)}
