"""What pages show of verdicts, questions, methods and times: tables follow from their rows."""

import re

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup
from builders import evidence_of as made_up

from nmpcrl.analysis.encounters import Contacts, Encounters
from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.robustness import robustness_map
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Verdict
from nmpcrl.report import remedies, tables, text, timing, worlds
from nmpcrl.report.drawn import at_the_gap, improve_by_gap
from nmpcrl.studies.difficulty import OPEN
from nmpcrl.studies.investigation import Answer
from nmpcrl.studies.population import Drawn
from nmpcrl.studies.remedies import ADVISED, FIRST, NEVER, PARTS, REMEDIES
from nmpcrl.studies.worlds import ORACLES, VIEWS
from nmpcrl.study import paper
from nmpcrl.study.design import VARIANTS
from nmpcrl.study.drawn import JUDGE
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.moving import still

SHORT, LONG = ADVISED


def verdict(outcome: str, **judged) -> Verdict:
    return Verdict("C1", "a < b & c.", outcome, "Elsewhere (departure G).", **judged)


def cells(table: str) -> list[list[str]]:
    """The words of a table, row by row, its header included."""
    rows = BeautifulSoup(re.sub("</?code>", "`", table), "html.parser").find_all("tr")
    return [[cell.get_text("|") for cell in row.find_all(["th", "td"])] for row in rows]


# Claims


def test_a_verdict_shows_its_share_and_interval():
    known, own = verdict(NOT), verdict(PARTLY, share=0.75, interval=(0.5, 0.875))
    shown = tables.verdict_table([known], "<All of it.>", [own])
    header, row = cells(shown)
    assert header == ["", "the paper claims", "published", "runs of this page"]
    assert row == ["C1", "a < b & c.", NOT, f"{PARTLY}|75% [50%, 88%]"]
    assert cells(tables.verdict_table([own], ""))[1][2] == row[3]
    assert "<caption>&lt;All of it.&gt;</caption>" in shown


def test_the_map_has_an_arrow_for_every_change_and_an_outcome_is_the_same_up_to_where_it_turns():
    found = made_up(lambda e: {"end": 1.2} if e.layout == "A" else {"swing": 0.1})
    judged = robustness_map(found.runs, found.paths)
    shown = cells(tables.verdict_map(judged))
    assert sum(" → " in cell for row in shown for cell in row) == judged.changes.sum() > 0
    table = tables.other_thresholds(found.runs, found.paths)
    assert [*table.index] == [*BY_RUNS]
    assert table.threshold["C9"] == "0.01"
    outcome = ["no", "no", "yes", "yes", "yes", "no", "yes"]
    curve = pd.DataFrame({"border": np.arange(1.0, 8.0), "outcome": outcome})
    stays = [tables.same_outcome(curve, border) for border in (4.0, 1.0, 7.0)]
    assert stays == [(3.0, 5.0), (1.0, 2.0), (7.0, 7.0)]


def test_runs_are_split_by_whether_theta_c_has_closed_a_gap_where_there_is_one():
    names = ["J001", "J002", "J003"]
    found = made_up(layouts=tuple(JUDGE[name] for name in names), seeds=(0,))
    runs = found.runs.assign(part="judge", theta_8=0.2, distance=0.0)
    costs = {
        Experiment(layout=JUDGE[name]).layout: cost
        for name, cost in zip(names, (0.9, 0.995, 1.1), strict=True)
    }
    runs["final_cost"] = runs.initial_cost * [costs[layout] for layout in runs.layout]
    closes = pd.DataFrame({"closes": {"J001": 0.3, "J002": 0.1, "J003": OPEN}})
    each = len(runs[runs.learner == "ES"]) // 3
    counts = improve_by_gap(at_the_gap(Drawn(runs, {}, closes)))
    assert counts == {"open": (each, each), "closed": (0, each)}


CHANGED = ["variant", "claim", "changes"]


@pytest.mark.parametrize(
    ("layouts", "decays", "disagreeing"),
    [
        ("yyyy", "yy", (False, False)),
        ("yyny", "yy", (True, False)),
        ("yypy", "yn", (True, True)),
        ("yyoy", "yo", (False, False)),  # what is not decided contradicts nothing
        ("oooo", "oo", (False, False)),
    ],
)
def test_layouts_and_readings_disagree_where_two_decided_verdicts_differ(
    layouts, decays, disagreeing
):
    read = {"y": REPRODUCED, "p": PARTLY, "n": NOT, "o": UNDECIDABLE}
    by = [{name: read[one] for name, one in zip(names, of, strict=True)}
          for names, of in (("ABCD", layouts), (("step", "episode"), decays))]  # fmt: skip
    judged = [verdict(PARTLY, by_layout=by[0], by_decay=by[1]), verdict(NOT)]
    depending = text.depends_on(judged, pd.DataFrame(columns=CHANGED))
    assert ("B" in depending, "C" in depending) == disagreeing


def test_a_departure_counts_every_variant_that_reads_it_otherwise():
    assert (VARIANTS["tanh"].departure, VARIANTS["four fits"].departure) == ("H", "H")
    assert VARIANTS["alpha x 3"].departure == ""
    rows = [
        ("tanh", "C6", True),
        ("four fits", "C1", True),
        ("four fits", "C6", True),
        ("soft box", "C5", False),
        ("alpha x 3", "C9", True),
    ]  # the paper is clear about alpha
    judged = [verdict(PARTLY, by_layout={"A": REPRODUCED, "B": NOT})]
    found = text.depends_on(judged, pd.DataFrame(rows, columns=CHANGED))
    assert found == {"B": ("C1",), "H": ("C1", "C6")}


# Questions, methods and times


@pytest.mark.parametrize(
    ("answer", "shown"),
    [
        (Answer(REPRODUCED, {"layouts": (14, 15)}, question="guard"),
         ["confirmed", "14 of 15 layouts: 93% [70%, 99%]"]),
        (Answer(NOT, {"layouts": (0, 0)}, {"difference": -0.1, "low": -np.inf}, {"all": (1, 2)},
                question="guard"),
         ["contradicted", "0 of 0 layouts; 1 of 2 all; difference -0.1; low -inf"]),
    ],
)  # fmt: skip
def test_an_answer_comes_with_its_question_its_evidence_and_what_was_expected(answer, shown):
    asked, row = REMEDIES.asked["guard"], cells(tables.answer_table([answer], REMEDIES.asked))[1]
    question = f"{asked.pilot} {asked.question}".strip()
    assert row == ["guard", question, "confirmed", *shown]


def advised(entry, word, part=SHORT, gain=(0.8, 0.7, 0.9), share=0.9, setting=""):
    solved = Estimate(share, 0.8, 0.95)
    found = {"part": part, "entry": entry, "name": entry + setting, "gain": Estimate(*gain)}
    found |= {"solved": solved, "layouts": 120, "left_out": 2, "rollouts": 49, "seconds": 0.54}
    return found | {"word": word, "tuning": 3000}


ADVICE = pd.DataFrame(
    [
        advised("CMA-ES", FIRST, setting="[spread=0.1]"),
        advised("CMA-ES", FIRST, LONG, (0.99, 0.98, 1.0)),
        advised("DPG", NEVER, gain=(-np.inf, -np.inf, -0.2), share=1.0),
    ]
)


def test_a_method_has_its_word_its_evidence_and_its_price_by_budget_the_smaller_first():
    head, first, last = cells(remedies.advice_table(ADVICE, "All."))
    assert len(head) == len(first) == len(last)
    assert first[0] == "`CMA-ES|[spread=0.1]`"
    assert first[1].startswith(f"{FIRST}|a search of all nine numbers by CMA-ES")
    assert first[2] == "0.80 [0.70, 0.90]|90% [80%, 95%]| of 120 layouts; 49 rollouts, 0.5 s"
    assert first[3].startswith("0.99 [0.98, 1.00]|")
    assert last[2].startswith("-∞ [-∞, -0.20]|")
    assert last[3] == "–"
    found = remedies.evidence(ADVICE, "CMA-ES")
    assert f"{found['gain'].value:.2f}" == "0.80 [0.70, 0.90]"
    assert found["solved"].value.value == pytest.approx(0.9)


def test_a_part_has_each_layout_the_greatest_share_first_and_a_star_where_one_is_unsolved():
    part = PARTS["named 50"]
    rows = [
        {"part": "named 50", "entry": entry, "arm": entry, "place": layout, "k": k,
         "initial": 100.0, "best": 80.0, "cost": cost, "arrived": cost < 90, "episodes": 50,
         "over": False, "seconds": 0.5}
        for entry, cost in (("ES", 110.0), ("SPSA", 84.0))
        for layout in part.places
        for k in range(part.seeds)
    ]  # fmt: skip
    shown = remedies.named_table(pd.DataFrame(rows), "named 50")
    assert [*shown.columns] == [*"ABCDEF", "solved", "CPU time [s]"]
    assert [*shown.index] == ["SPSA", "ES"]
    assert [*shown.loc["SPSA"]] == [*["0.80"] * 6, "6 of 6", "0.5"]
    assert [*shown.loc["ES"]] == [*["-0.50*"] * 6, "0 of 6", "0.5"]


def test_a_ratio_of_times_has_its_interval_and_is_one_half_where_slow_solves_are_alike(timings):
    shown = str(timing.to_es(timings, "ipopt", "RDES"))
    row = timings.set_index(["solver", "learner"]).loc["ipopt", "RDES"]
    interval = f"{row.ratio:.2f} [{row.ratio_low:.2f}, {row.ratio_high:.2f}]"
    assert f">{interval}</data>" in shown
    assert 'title="step of RDES in steps of ES, with ipopt: the published measurement"' in shown
    with pytest.raises(KeyError):
        timing.to_es(timings, "scipy", "RDES")
    timings.loc[timings.learner == "ES", "ms_per_solve"] *= 0.8
    alike, warm = timing.ratios_at_paper_speed(timings)
    assert (alike, warm) == (pytest.approx(0.5, abs=0.005), pytest.approx(0.63, abs=0.005))


# Worlds that change


def test_what_is_saved_is_a_share_of_the_same_layout_and_there_is_no_oracle_of_a_lag():
    costs = {f"{fault} {how}": cost for fault in (*ORACLES, "lag")
             for how, cost in {"init": 100.0, "oracle": 95.0, "ES": 95.0, "grid": 90.0}.items()
             if (fault, how) != ("lag", "oracle")}  # fmt: skip
    rows = [{"part": "model", "arm": arm, "place": place, "cost": cost * size}
            for arm, cost in costs.items() for place, size in (("J001", 1), ("J002", 2))
            if "grid" not in arm or place == "J001"]  # fmt: skip
    found = worlds.saved(pd.DataFrame(rows))
    assert [*found.index.unique(0)] == [*ORACLES, "lag"]  # noise has no rows
    assert found.oracle["lag"].isna().all()
    assert found.grid["speed"].dropna().to_dict() == pytest.approx({"J001": 0.1})
    assert found.ES["lag"].tolist() == pytest.approx([0.05, 0.05])


def test_depth_is_measured_from_the_edge_and_each_view_and_policy_has_a_row():
    one = Encounters(np.zeros((paper.STEPS + 1, 3)), 0.0, Contacts(0, 0), arrived=False)
    assert worlds.deepest(one, still([(3.0, 0.0), (1.0, 0.0)])) == pytest.approx(0.25)
    assert worlds.deepest(one, still([(3.0, 0.0)])) == 0
    runs = [
        {"part": "moving", "arm": f"{view} {policy}", "place": place, "k": k, "cost": cost,
         "arrived": True, "inside": k * (policy == "ES"), "seconds": 1.0}
        for view in VIEWS
        for policy, cost in zip(worlds.POLICIES, (100.0, 90.0, 95.0, 80.0), strict=True)
        for place in ("M01", "M02")
        for k in range(3 if policy == "ES" else 1)
    ]  # fmt: skip
    found = worlds.moving(pd.DataFrame(runs))
    of = found.loc[("extrapolated", "ES")]
    assert (of.cost.value, of.saved.value) == (pytest.approx(0.9), pytest.approx(0.1))
    assert (of.solved.value, of.clear.value, of.inside) == (1, 0, (2, 2))
    assert len(found) == len(VIEWS) * len(worlds.POLICIES)
