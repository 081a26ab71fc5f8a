"""Every verdict can come out each way, and thresholds are respected exactly at the border."""

from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.statistics import rate
from nmpcrl.analysis.summary import row, summarise, table
from nmpcrl.claims import own_claims, paper_claims
from nmpcrl.claims.assumptions import Assumption
from nmpcrl.claims.paper_claims import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.claims.robustness import flips, spread
from nmpcrl.study import Experiment, Runs, paper, run
from nmpcrl.study.experiment import PAPER
from nmpcrl.study.setup import LEARNERS

START_COST = 1000.0  # noise-free cost of theta_init
SEEDS = range(5)
PLACE = np.zeros((3, 3))  # a drive that stands still

Changes = Callable[[Experiment], dict[str, Any]]


def summary(experiment: Experiment) -> dict[str, Any]:
    """The row of a run in which nothing happened."""
    fields = asdict(experiment) | {"theta": " ".join(map(repr, experiment.theta))}
    still = {"stopped": "finished", "initial_cost": START_COST, "final_cost": START_COST}
    still |= {"late_cost_range": 0.0, "cost_ratio": 1.0, "inputs": 0, "outside": 0, "distance": 0.1}
    still |= {"steps_done": 39_000, "worst_overlap": 0.0, "eval_worst_overlap": 0.0}
    for name, size in product(("inside", "eval_inside"), ("small", "medium", "large")):
        still[f"{name}_{size}"] = 0
    still |= {"imitation_with": 0.5, "imitation_without": 1.0}
    return fields | still | {f"theta_{i}": value for i, value in enumerate(experiment.theta)}


def study(
    changes: Changes = lambda _: {}, *, learners=LEARNERS, layouts=("A",), **fields
) -> pd.DataFrame:
    """Runs with both readings and five seeds; `changes` says what is unlike `summary` in each."""
    named = [
        Experiment(learner, seed=seed, layout=layout, decay=decay, **fields)
        for learner, layout, decay, seed in product(learners, layouts, ("step", "episode"), SEEDS)
    ]
    return pd.DataFrame([summary(one) | changes(one) for one in named])


def of(learner: str, seeds=SEEDS, **columns: Any) -> Changes:
    """What is unlike in the runs of one learner with these seeds, in both readings."""
    return lambda e: columns if e.learner == learner and e.seed in seeds else {}


def both(*changes: Changes) -> Changes:
    return lambda e: {name: value for one in changes for name, value in one(e).items()}


def paths(runs: pd.DataFrame, apart: float = 0.0, seeds=SEEDS) -> dict[Experiment, np.ndarray]:
    """Drives that stand still, those of RDES with some seeds a step away [m]."""
    named = [paper_claims.experiment_of(one) for one in runs.to_dict("records")]
    away = {e: apart if e.learner == "RDES" and e.seed in seeds else 0.0 for e in named}
    return {e: PLACE + [away[e], 0, 0] for e in named}


def timings(rdes=0.5, ges=1.0) -> pd.DataFrame:
    """Times of a step, ES taking 1 ms."""
    per_step = {"ES": 1.0, "RDES": rdes, "GES": ges}
    return pd.DataFrame(
        [
            {"solver": solver, "learner": learner, "ms_per_step": ms, "ms_per_fit": 0.1}
            for solver in ("fatrop", "ipopt", "riccati")
            for learner, ms in per_step.items()
        ]
    )


def judge(runs: pd.DataFrame) -> tuple[paper_claims.Verdict, ...]:
    broken = [Assumption("a finite MDP", "it is not", holds=False)]
    return paper_claims.judge(runs, paths=paths(runs), timings=timings(), assumptions=broken)


SOME = range(2)  # of five seeds
BAD = {"cost_ratio": 1.6}
SWAYING = {"late_cost_range": 0.06}


# C1 and C2: a contrast between two learners

CONTRASTS = [
    (SEEDS, (), REPRODUCED),
    (SOME, (), PARTLY),
    (SEEDS, SOME, PARTLY),
    ((), (), NOT),
    (SEEDS, SEEDS, NOT),
    ((), SEEDS, NOT),
]


@pytest.mark.parametrize(("des", "rdes", "outcome"), CONTRASTS)
def test_c1_asks_in_how_many_pairs_des_diverged_and_rdes_did_not(des, rdes, outcome):
    runs = study(both(of("DES", des, **BAD), of("RDES", rdes, **BAD)))
    verdict = paper_claims.des_diverges_and_rdes_does_not(runs)
    assert (verdict.claim, verdict.outcome) == ("C1", outcome)
    spared = [seed for seed in des if seed not in rdes]
    assert verdict.counts["all"] == (2 * len(spared), 10)


@pytest.mark.parametrize(("es", "ges", "outcome"), CONTRASTS)
@pytest.mark.parametrize("why", [SWAYING, BAD])  # what diverged is unstable, too
def test_c2_asks_in_how_many_pairs_es_was_unstable_and_ges_was_not(es, ges, outcome, why):
    verdict = paper_claims.es_is_unstable_and_ges_is_stable(
        study(both(of("ES", es, **why), of("GES", ges, **why)))
    )
    assert (verdict.claim, verdict.outcome) == ("C2", outcome)


@pytest.mark.parametrize(
    ("columns", "diverged"),
    [
        ({"cost_ratio": paper_claims.DIVERGED}, False),
        ({"cost_ratio": np.nextafter(paper_claims.DIVERGED, 2)}, True),
        ({"cost_ratio": np.inf}, True),
        ({"cost_ratio": 0.1, "stopped": "diverged: theta"}, True),
        ({"cost_ratio": np.nan, "stopped": "diverged: theta"}, True),
        ({"cost_ratio": np.nan}, pd.NA),
    ],
)
def test_a_run_diverged_if_it_was_stopped_or_cost_more_than_the_threshold(columns, diverged):
    judged = paper_claims.divergence(study(of("DES", **columns), learners=("DES",)))
    expected = pd.Series([diverged] * len(judged), dtype="boolean")
    pd.testing.assert_series_equal(judged, expected, check_names=False)


@pytest.mark.parametrize(
    ("late_cost_range", "unstable"),
    [
        (paper_claims.UNSTABLE, False),
        (np.nextafter(paper_claims.UNSTABLE, 1), True),
        (np.inf, True),
    ],
)
def test_a_swing_of_exactly_the_threshold_is_stable(late_cost_range, unstable):
    judged = paper_claims.instability(
        study(of("ES", late_cost_range=late_cost_range), learners=("ES",))
    )
    assert judged.unique().tolist() == [unstable]


def test_without_a_frozen_arm_nothing_is_said_of_divergence():
    runs = study(lambda _: {"cost_ratio": np.nan})
    outcomes = {v.claim: v.outcome for v in paper_claims.judge_runs(runs, paths(runs))}
    assert {c for c, outcome in outcomes.items() if outcome == UNDECIDABLE} == {"C1", "C2"}


# C3 and C4: ratios of times


@pytest.mark.parametrize(
    ("measured", "outcome"),
    [(0.39, PARTLY), (0.4, REPRODUCED), (0.6, REPRODUCED), (0.61, PARTLY), (1.0, NOT), (1.3, NOT)],
)
def test_c3_wants_half_of_the_time_with_the_paper_s_solver(measured, outcome):
    verdict = paper_claims.rdes_takes_half_the_time(timings(rdes=measured))
    assert (verdict.claim, verdict.outcome) == ("C3", outcome)
    assert f"{measured:.2f} with ipopt, {measured:.2f} with fatrop" in verdict.evidence


@pytest.mark.parametrize(
    ("measured", "outcome"),
    [(0.7, NOT), (0.85, PARTLY), (0.9, REPRODUCED), (1.1, REPRODUCED), (1.2, PARTLY), (1.25, NOT)],
)
def test_c4_wants_the_same_time(measured, outcome):
    verdict = paper_claims.ges_takes_the_same_time(timings(ges=measured))
    assert (verdict.claim, verdict.outcome) == ("C4", outcome)


@pytest.mark.parametrize(
    "missing",
    [
        pd.DataFrame(),
        timings()[lambda t: t.solver != "ipopt"],
        timings()[lambda t: t.learner == "ES"],
    ],
)
def test_what_was_not_timed_with_the_paper_s_solver_is_not_decided(missing):
    assert paper_claims.rdes_takes_half_the_time(missing).outcome == UNDECIDABLE
    assert paper_claims.ges_takes_the_same_time(missing).outcome == UNDECIDABLE


# C5: the same policy


@pytest.mark.parametrize(
    ("apart", "final", "seeds", "outcome"),
    [
        (0.0, START_COST, SEEDS, REPRODUCED),
        (paper_claims.SAME_PATH, START_COST * (1 - paper_claims.SAME_COST), SEEDS, REPRODUCED),
        (paper_claims.SAME_PATH + 1e-9, START_COST, SEEDS, NOT),
        (0.0, START_COST * (1 - paper_claims.SAME_COST) - 1e-9, SEEDS, NOT),
        (1.0, START_COST, SOME, PARTLY),
        (np.nan, np.inf, SEEDS, NOT),  # rollouts that failed
    ],
)
def test_c5_wants_the_same_path_and_the_same_cost(apart, final, seeds, outcome):
    runs = study(of("RDES", seeds, final_cost=final))
    verdict = paper_claims.rdes_and_ges_reach_the_same_policy(runs, paths(runs, apart, seeds))
    assert (verdict.claim, verdict.outcome) == ("C5", outcome)


def test_c5_compares_theta_and_does_not_judge_it():
    runs = study(of("RDES", theta_0=2.0))
    verdict = paper_claims.rdes_and_ges_reach_the_same_policy(runs, paths(runs))
    assert verdict.outcome == REPRODUCED
    assert "theta by up to 50% (medians)" in verdict.evidence


def test_two_policies_that_both_fail_are_not_the_same():
    runs = study(lambda _: {"final_cost": np.inf})
    failed = {e: np.full_like(PLACE, np.nan) for e in paths(runs)}
    assert paper_claims.rdes_and_ges_reach_the_same_policy(runs, failed).outcome == NOT


def test_a_run_that_had_to_be_stopped_left_no_policy_however_low_its_last_cost():
    runs = study(lambda _: {"final_cost": 500.0, "stopped": "diverged: theta"})
    outcomes = {v.claim: v.outcome for v in paper_claims.judge_runs(runs, paths(runs))}
    assert outcomes["C5"] == outcomes["C9"] == NOT
    runs = study(of("TDC", final_cost=500.0, stopped="diverged: theta"))
    assert own_claims.tdc_is_at_least_as_good_as_ges(runs).outcome == NOT


def test_a_path_that_is_not_there_is_no_answer():
    runs = study()
    assert paper_claims.rdes_and_ges_reach_the_same_policy(runs, {}).outcome == UNDECIDABLE


def test_robots_are_as_far_apart_as_they_ever_come_whatever_their_headings():
    one, other = np.zeros((2, 4, 3))
    other[2], other[3] = (3.0, 4.0, 0.0), (0.0, 0.0, 9.0)
    assert paper_claims.apart(one, other) == 5


# C6: the network


@pytest.mark.parametrize(
    ("told", "seeds", "outcome"),
    [
        (paper_claims.MORE_ACCURATE, SEEDS, REPRODUCED),
        (np.nextafter(paper_claims.MORE_ACCURATE, 1), SOME, PARTLY),
        (np.nextafter(paper_claims.MORE_ACCURATE, 1), SEEDS, NOT),
        (np.nan, SEEDS, UNDECIDABLE),
    ],
)
def test_c6_wants_a_clearly_smaller_error(told, seeds, outcome):
    verdict = paper_claims.theta_makes_the_network_more_accurate(
        study(of("RDES", seeds, imitation_with=told))
    )
    assert (verdict.claim, verdict.outcome) == ("C6", outcome)


# C7: constraints


@pytest.mark.parametrize(
    ("columns", "seeds", "outcome"),
    [
        ({}, SEEDS, REPRODUCED),
        ({"inside_small": 1}, SEEDS, PARTLY),
        ({"inside_large": 1}, SOME, PARTLY),
        ({"eval_inside_medium": 1}, SOME, PARTLY),
        ({"eval_inside_small": 1}, SEEDS, NOT),
        ({"inputs": 1}, SEEDS, NOT),
        ({"outside": 1}, SEEDS, REPRODUCED),  # the box is another constraint; it is counted
    ],
)
def test_c7_forgives_overlaps_in_training_in_part_and_no_others(columns, seeds, outcome):
    runs = study(lambda e: columns if e.seed in seeds else {})
    verdict = paper_claims.constraints_hold(runs)
    assert (verdict.claim, verdict.outcome) == ("C7", outcome)


def test_c7_counts_every_violation_by_size():
    sizes = {"inside_small": 7, "inside_medium": 2, "inside_large": 1, "eval_inside_large": 3}
    evidence = paper_claims.constraints_hold(study(of("ES", **sizes, inputs=4, outside=6))).evidence
    assert "40 actions left" in evidence
    assert "70, 20 and 10 lay in an obstacle" in evidence
    assert "without noise 0, 0 and 30" in evidence
    assert "60 states in training lay outside the box" in evidence


@pytest.mark.parametrize("learner", sorted(set(LEARNERS) - set(PAPER)))
def test_what_the_paper_does_not_have_is_not_asked_to_keep_its_promises(learner):
    worst = of(learner, eval_inside_large=9, inputs=9)
    assert paper_claims.constraints_hold(study(worst)).outcome == REPRODUCED


# C8: the theorem


@pytest.mark.parametrize(
    ("holds", "outcome"), [([True, True], REPRODUCED), ([True, False], NOT), ([], UNDECIDABLE)]
)
def test_c8_wants_every_assumption(holds, outcome):
    assumptions = tuple(Assumption("a finite MDP", "it is not", holds=one) for one in holds)
    verdict = paper_claims.convergence_is_guaranteed(assumptions)
    assert (verdict.claim, verdict.outcome) == ("C8", outcome)
    assert ("a finite MDP" in verdict.evidence) == (outcome == NOT)


# C9: better than not learning


@pytest.mark.parametrize(
    ("rdes", "ges", "outcome"),
    [
        (900.0, START_COST * (1 - paper_claims.BETTER), REPRODUCED),
        (900.0, START_COST * (1 - paper_claims.BETTER) + 1e-9, PARTLY),
        (1000.0, 1100.0, NOT),
        (np.inf, np.inf, NOT),
    ],
)
def test_c9_wants_both_methods_to_beat_the_frozen_theta(rdes, ges, outcome):
    runs = study(both(of("RDES", final_cost=rdes), of("GES", final_cost=ges)))
    verdict = paper_claims.learning_beats_the_frozen_theta(runs)
    assert (verdict.claim, verdict.outcome) == ("C9", outcome)
    assert verdict.counts["all"][1] == 20


def test_a_run_that_got_stuck_or_failed_is_said_to_be_so_and_counts():
    runs = study(both(of("RDES", (0,), final_cost=np.inf), of("GES", (1,), distance=5.0)))
    evidence = paper_claims.learning_beats_the_frozen_theta(runs).evidence
    assert "2 end more than 0.5 away" in evidence
    assert "in 2 runs one of the last three failed or training was stopped" in evidence


# All of them


def test_nine_claims_are_judged_in_order_and_each_says_what_it_rests_on():
    verdicts = judge(study())
    assert (
        [v.claim for v in verdicts] == [f"C{i}" for i in range(1, 10)] == list(paper_claims.CLAIMS)
    )
    assert all(v.statement and v.evidence and v.would_change for v in verdicts)
    assert {v.outcome for v in verdicts} <= {REPRODUCED, PARTLY, NOT, UNDECIDABLE}


def test_every_claim_says_beforehand_what_is_asked_and_where_the_border_is():
    for claim in (*paper_claims.CLAIMS.values(), *own_claims.ADDITIONS.values()):
        said = asdict(claim)
        assert bool(said.pop("learners")) == (claim.name not in ("C3", "C4", "C8")), claim
        assert all(said.values()), claim
        assert claim.question.endswith("?")


RUNS_DECIDE = {"C1", "C2", "C5", "C6", "C7", "C9"}


def test_runs_shorter_than_the_paper_s_decide_nothing_about_learning():
    outcomes = {v.claim: v.outcome for v in judge(study(episodes=paper.EPISODES - 1))}
    assert {c for c, outcome in outcomes.items() if outcome == UNDECIDABLE} == RUNS_DECIDE


def test_without_runs_nothing_is_decided():
    runs = study()
    verdicts = paper_claims.judge_runs(runs[runs.learner == "frozen"], {})
    assert {v.claim for v in verdicts} == RUNS_DECIDE
    assert {v.outcome for v in verdicts} == {UNDECIDABLE}


@pytest.mark.parametrize(
    ("absent", "open_"),
    [
        ("ES", {"C2", "C7"}),
        ("DES", {"C1", "C7"}),
        ("RDES", {"C1", "C5", "C6", "C7", "C9"}),
        ("GES", {"C2", "C5", "C7", "C9"}),
        ("frozen", set()),  # its costs are in the table already
    ],
)
def test_a_claim_about_a_learner_that_was_not_run_is_not_decided(absent, open_):
    runs = study()
    verdicts = paper_claims.judge_runs(runs[runs.learner != absent], paths(runs))
    assert {v.claim for v in verdicts if v.outcome == UNDECIDABLE} == open_


def test_layouts_may_differ_and_are_judged_one_by_one():
    def worse(e):
        return BAD if e.learner == "DES" and e.layout == "B" else {}

    verdict = paper_claims.des_diverges_and_rdes_does_not(study(worse, layouts=("A", "B")))
    assert verdict.by_layout == {"A": NOT, "B": REPRODUCED}
    assert verdict.outcome == PARTLY
    assert verdict.interval == (rate(10, 20).low, rate(10, 20).high)


def test_what_could_not_be_finished_is_shown_as_infinite_and_never_as_inf():
    lost = {"final_cost": np.inf, "cost_ratio": np.inf, "late_cost_range": np.inf}
    runs = study(lambda _: lost)
    evidence = [v.evidence for v in (*judge(runs), *own_claims.judge_additions(runs))]
    assert not any("inf" in sentence for sentence in evidence)
    assert "ended at ∞ and ∞ times" in evidence[0]


# One run, from its records


@pytest.fixture(scope="module")
def short():
    experiments = [Experiment(name, episodes=4, steps=6) for name in (*PAPER, "frozen")]
    experiments.append(Experiment("ES", alpha=1e5, seed=1, episodes=4, steps=6))
    experiments.append(Experiment("frozen", seed=1, episodes=4, steps=6))
    return Runs({one: run(one) for one in experiments})


def test_a_run_is_judged_from_its_records_as_from_the_table(short):
    runs = table([summarise(records) for records in short.values()])
    for rule, measured in (
        (paper_claims.diverged, paper_claims.divergence(runs)),
        (paper_claims.unstable, paper_claims.instability(runs)),
    ):
        judged = [rule(short, *pair) for pair in short.items()]
        assert judged == measured.tolist()
        assert set(judged) == {True, False}


def test_a_row_of_the_table_names_its_experiment(short):
    for experiment, records in short.items():
        runs = pd.DataFrame([row(summarise(records))])
        (one,) = runs.to_dict("records")
        assert paper_claims.experiment_of(one) == experiment


# What we add


@pytest.mark.parametrize(
    ("claim", "learner", "against", "border"),
    [
        (own_claims.tdc_is_at_least_as_good_as_ges, "TDC", "GES", 1 + paper_claims.SAME_COST),
        (own_claims.direction_matters, "ES", "random", 1 - paper_claims.BETTER),
        (
            own_claims.only_the_step_length_sets_ges_apart,
            "matched",
            "GES",
            1 + paper_claims.SAME_COST,
        ),
        (own_claims.q_learning_is_at_least_as_good_as_es, "QL", "ES", 1 + paper_claims.SAME_COST),
    ],
)
def test_an_addition_holds_up_to_its_border_and_not_beyond(claim, learner, against, border):
    for cost, outcome in ((border, REPRODUCED), (border + 1e-9, NOT)):
        runs = study(of(learner, final_cost=cost * START_COST))
        assert claim(runs).outcome == outcome
    some = study(of(learner, SOME, final_cost=border * START_COST + 20))
    assert claim(some).outcome == (NOT if learner == "ES" else PARTLY)
    assert claim(runs[runs.learner != learner]).outcome == UNDECIDABLE
    assert claim(runs[runs.learner != against]).outcome == UNDECIDABLE


def test_a_learner_that_ends_alike_may_not_end_cheaper_either():
    runs = study(of("matched", final_cost=(1 - paper_claims.SAME_COST) * START_COST - 1e-9))
    assert own_claims.only_the_step_length_sets_ges_apart(runs).outcome == NOT


def test_of_two_failures_none_is_better_and_none_is_worse():
    runs = study(lambda _: {"final_cost": np.inf})
    outcomes = {v.claim: v.outcome for v in own_claims.judge_additions(runs)}
    assert outcomes == {"B1": REPRODUCED, "B2": NOT, "B3": REPRODUCED, "B4": REPRODUCED}


def test_an_addition_is_judged_where_its_learner_was_run():
    runs = study(layouts=("A", "B"))
    verdict = own_claims.direction_matters(runs[(runs.learner != "random") | (runs.layout == "B")])
    assert verdict.by_layout == {"B": NOT}


def test_the_evidence_of_an_addition_has_the_probability_of_improvement():
    runs = study(of("TDC", final_cost=900.0))
    evidence = own_claims.tdc_is_at_least_as_good_as_ges(runs).evidence
    assert "TDC costs less than one of GES with probability 1.00 [1.00, 1.00]" in evidence
    assert "fell by +10.0% and +0.0%" in evidence


# What verdicts depend on


def varied(main: pd.DataFrame, **variants: pd.DataFrame) -> pd.DataFrame:
    parts = {"main": main} | variants
    return pd.concat([runs.assign(variant=name) for name, runs in parts.items()])


def one(frame: pd.DataFrame, variant: str, claim: str) -> pd.Series:
    (found,) = frame[(frame.variant == variant) & (frame.claim == claim)].itertuples()
    return found


def test_a_variant_flips_the_claims_whose_outcome_it_changes():
    hot = study(of("DES", **BAD), learners=PAPER, alpha=3e-7)
    runs = varied(study(), hot=hot)
    frame = flips(runs, paths(runs))
    assert set(frame.claim) == RUNS_DECIDE
    assert frame[frame.flips].claim.tolist() == ["C1"]
    flipped = one(frame, "hot", "C1")
    assert (flipped.base, flipped.outcome, flipped.base_share, flipped.share) == (
        NOT,
        REPRODUCED,
        0,
        1,
    )
    assert flipped.p == pytest.approx(2 / 184756)  # two of the 20 over 10 ways to deal them out
    assert one(frame, "hot", "C2").p == 1


def test_a_variant_is_held_against_the_main_table_in_its_own_cells():
    main = study(
        lambda e: BAD if e.learner == "DES" and e.layout == "B" else {}, layouts=("A", "B")
    )
    runs = varied(main, soft=study(learners=PAPER, layouts=("A",), box="soft"))
    cell = one(flips(runs, paths(runs)), "soft", "C1")
    assert (cell.base, cell.outcome, cell.pairs) == (NOT, NOT, 10)


def test_a_learner_that_a_variant_does_not_change_is_taken_from_the_main_table():
    main = study(of("ES", **SWAYING))
    runs = varied(main, slow=study(of("GES", **SWAYING), learners=("GES",), beta=1e-6))
    frame = flips(runs, paths(runs))
    assert (one(frame, "slow", "C2").base, one(frame, "slow", "C2").outcome) == (REPRODUCED, NOT)
    assert (one(frame, "slow", "C9").base, one(frame, "slow", "C9").outcome) == (NOT, NOT)


def test_a_claim_about_learners_that_a_variant_does_not_change_cannot_flip():
    runs = varied(study(), slow=study(learners=("GES",), beta=1e-6))
    assert set(flips(runs, paths(runs)).claim) == {"C2", "C5", "C7", "C9"}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(RUNS_DECIDE | set(own_claims.ADDITIONS)))
def test_those_whom_a_claim_asks_decide_it(name):
    runs = study(lambda e: BAD if e.learner in ("DES", "ES", "matched", "QL") else {})

    def outcome(some: pd.DataFrame) -> str:
        decided = (*judge(some), *own_claims.judge_additions(some))
        return next(v.outcome for v in decided if v.claim == name)

    asked = (paper_claims.CLAIMS | own_claims.ADDITIONS)[name].learners
    alone = runs[runs.learner.isin(asked)]
    assert outcome(alone) == outcome(runs) != UNDECIDABLE
    for learner in asked:
        assert outcome(runs[runs.learner != learner]) == UNDECIDABLE


def test_what_is_undecided_flips_nothing():
    runs = varied(study(), cut=study(learners=PAPER, episodes=10))
    frame = flips(runs, paths(runs))
    assert set(frame.outcome) == {UNDECIDABLE}
    assert not frame.flips.any()


def test_controls_are_no_variant_of_the_paper_s_claims():
    runs = varied(study(learners=PAPER), controls=study(learners=("random", "QL")))
    assert flips(runs, paths(runs)).empty


def test_layouts_and_readings_are_shown_as_variants_are():
    def worse(e):
        return BAD if e.learner == "DES" and e.layout == "B" else {}

    runs = study(worse, layouts=("A", "B"))
    frame = spread(judge(runs))
    assert list(frame.columns) == list(flips(varied(runs), {}).columns)
    assert frame[frame.claim == "C1"].variant.tolist() == [
        "layout A",
        "layout B",
        "decay per step",
        "decay per episode",
    ]
    cell = one(frame, "layout B", "C1")
    assert (cell.outcome, cell.base, cell.flips) == (REPRODUCED, PARTLY, True)
    assert (cell.share, cell.base_share, cell.pairs) == (1, 0, 10)
    assert not set(frame.claim) & {"C3", "C4", "C8"}


def test_a_setting_is_judged_at_a_time():
    runs = study()
    two = pd.concat([runs, study(alpha=3e-7)])
    with pytest.raises(ValueError, match="DES has several runs in layout A"):
        paper_claims.judge_runs(two, paths(two))


def test_nudged_runs_keep_every_digit_of_their_theta():
    theta = tuple(np.nextafter(paper.THETA_INIT, 9))
    perturbed = replace(Experiment(), theta=tuple(map(float, theta)))
    assert paper_claims.experiment_of(summary(perturbed)) == perturbed
