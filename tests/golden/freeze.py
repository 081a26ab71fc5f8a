"""What the published files come to, frozen: `python tests/golden/freeze.py` writes it anew.

`FILES` has the entries of each JSON file beside this one, with what computes them from what is
published; nothing is trained. `test_golden` compares all of them with what the library says.
"""

import json
import sys
from bisect import bisect
from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any
from unittest import mock

import pandas as pd
from plain_values import plain, plain_name, processor, short, table

from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.analysis.suite import seed_of
from nmpcrl.bench.learners import ratio
from nmpcrl.claims import (
    finding,
    own_claims,
    paper_claims,
    published,
    robustness,
    rule,
    thresholds,
)
from nmpcrl.report import drawn as drawn_report
from nmpcrl.report import worlds as world_report
from nmpcrl.studies import (
    agents,
    interventions,
    main_study,
    other_problems,
    population,
    remedies,
    worlds,
)
from nmpcrl.studies.difficulty import predictor_scores
from nmpcrl.study import design, paper, provenance
from nmpcrl.study.drawn import JUDGE, LAYOUTS, SCENARIOS, TUNE
from nmpcrl.study.experiment import PAPER

FOLDER = Path(__file__).parent
ROLLOUT = 6  # digits of a cost of a rollout, or of an optimum, that are the same on all machines
RAISED = 4  # digits of a difference of two such costs


def computed(file: str) -> dict[str, Any]:
    """All entries of a file, as its JSON has them."""
    return {name: plain(compute()) for name, compute in FILES[file].items()}


def frozen(file: str) -> dict[str, Any]:
    """The same as it was written."""
    return json.loads((FOLDER / f"{file}.json").read_text("utf-8"))


def write() -> None:
    """Write all files anew."""
    for file in FILES:
        text = json.dumps(computed(file), indent=1, sort_keys=True, ensure_ascii=False)
        (FOLDER / f"{file}.json").write_text(f"{text}\n", "utf-8")


# What is asked of below, loaded once.

study, drawn = published.load, population.load
suite = cache(lambda: remedies.REMEDIES.table())
trained = cache(lambda: agents.SAC_AND_TD3.table())
changing = cache(lambda: worlds.WORLDS.table())
again = cache(lambda: interventions.ends(interventions.INTERVENTIONS.table()))
problems = cache(lambda: other_problems.runs(other_problems.OTHER_PROBLEMS.table()))
every = cache(lambda: main_study.gather("published", variants=True))
six_paths = cache(lambda: every().paths)
gap = cache(lambda: drawn_report.at_the_gap(drawn()))


def verdicts() -> Any:
    """Each verdict, and what it says of layouts drawn anew, of its halves and of other readings."""
    return {
        one.claim: plain(one)
        | {"halves": {f"{half.wrong}, per {half.decay}": half for half in one.halves}}
        | {"p": [half.p for half in one.halves], "turns": one.turns}
        | {"anew": rule.anew(one) if one.counts else None}
        | {"depends": [one.depends_on("layout"), one.depends_on("decay")]}
        for one in study().verdicts
    }


def other_borders() -> Any:
    """What the borders of each claim are held against, and the outcome at each."""
    own = study().runs[study().runs.variant.isin([design.MAIN_TABLE, "controls"])]
    runs = dict.fromkeys(paper_claims.BY_RUNS, every().main.runs)
    known = {}
    for name, claim in {**paper_claims.BY_RUNS, **own_claims.OWN_CLAIMS}.items():
        values = claim.measure(runs.get(name, own), six_paths())
        known[name] = {
            "values": table(values),
            "borders": table(claim.at_borders(values, claim.borders)),
            "steady": claim.steady(values),
        }
    return known


def answers_of_thresholds() -> Any:
    names = ("was_stopped", "worsens", "improves", "solved", "cost_reduction", "late_cost_range")
    names += ("divergence", "instability")
    return table(pd.DataFrame({name: getattr(thresholds, name)(study().runs) for name in names}))


def middle_of_each_learner() -> Any:
    left = study().main.runs
    left = left.assign(
        share=left.final_cost.where(left.stopped == "finished", float("inf")) / left.initial_cost
    )
    return {name: interquartile_mean(one.share.to_numpy(), [*one.layout])
            for name, one in left.groupby("learner")}  # fmt: skip


def shares_of_the_possible() -> Any:
    gains = {layout: found.gain for layout, found in study().searches.items()}
    return table(thresholds.share_of_possible(study().main.runs, gains))


def shares_in_a_to_f() -> Any:
    runs = study().runs[study().runs.variant == design.MAIN_TABLE]
    where = population.by_layout(runs, study().paths, [*population.EXPECTED])
    return population.shares(where).set_index("claim")


def predictors() -> Any:
    parts, layouts = drawn().runs.groupby("part"), drawn().layouts
    tuned, judged = population.succeeds(parts.get_group("tune")), population.succeeds(drawn().main)
    found = predictor_scores(layouts, tuned, judged)
    fitted = ("slope", "brier")  # of which BFGS finds no more digits
    return found.assign(**{name: [plain(one, ROLLOUT) for one in found[name]] for name in fitted})


def whole_picture_tried() -> Any:
    tried = drawn().tried
    counts = tried.groupby(["setting", "whole"], sort=False).size()
    return {"cells": table(tried), "by setting": counts, "nearest": tried.head(5)}


def runs_made_again() -> Any:
    asked = [("true slope", "none"), ("theta held", "none"), ("nudged", "none")]
    asked += [("true slope", "nudged"), ("theta held", "nudged")]
    parts = again().groupby("part", sort=False)
    return {f"{part}: {arm}, {than}": interventions.live(runs, arm, than)
            for part, runs in parts for arm, than in asked}  # fmt: skip


def advice() -> Any:
    advised = remedies.advice(suite())
    expected = remedies.expectations(advised) | {"greatest": remedies.greatest(advised)}
    return {"expected": expected, "order": [*advised.entry.unique()],
            "rows": advised.set_index(["entry", "part"])}  # fmt: skip


def courses() -> Any:
    asked = [("judge", ()), ("one", ()), ("all", ()), ("all", [*TUNE]), ("all", [*JUDGE])]
    found = {}
    for (part, among), agent in product(asked, agents.AGENTS):
        one = agents.course(trained(), part, agent, among)
        found[f"{agent}, {part}, {one.shares.shape[1]}"] = {
            "shares": table(one.shares), "there": table(one.there), "numbers": one.numbers,
            "median": one.median, "interval": one.interval,
        }  # fmt: skip
    return found


def means_in_worlds() -> Any:
    """The mean of each arm in each part, and its median over places."""
    found = {}
    for part, column in product(worlds.PARTS, ("cost", "inside", "arrived")):
        means = worlds.means(changing(), part, column)
        found[f"{part}, {column}"] = {"all": table(means), "median": means.median()}
    return found


# What names a run: no edit may change a key, or stored runs would be trained again.


def keys() -> Any:
    """Keys of all runs of the study and of their summaries, with what made the first of them."""
    first, rows, parts = study().batches[0], study().rows, design.whole_study()
    with (
        mock.patch.object(provenance, "installed", first["versions"].__getitem__),
        mock.patch.object(provenance, "EPOCHS", first["epochs"]),
    ):
        known = {e: (provenance.key(e), provenance.summary_key(e)) for e in parts}
    return {
        "first of each part": {part: known[e] for e, part in reversed(parts.items())},
        "as published": sum(rows[e]["key"] == one for e, (_, one) in known.items() if e in rows),
        "all, in their order": [len(known), short([*known.values()])],
    }


def seeds() -> Any:
    places = {part: [*one.places] for part, one in worlds.PARTS.items()}
    return {
        "remedies": short([seed_of(place, 0) for place in (*LAYOUTS, *paper.LAYOUTS)]),
        "agents": [agents.seed_of(place, 1) for place in (agents.EVERY, "A", "J001")],
        "worlds": {part: short([worlds.WORLDS.seed(place, 1) for place in some])
                   for part, some in places.items()},
    }  # fmt: skip


FILES: dict[str, dict[str, Callable[[], Any]]] = {  # by file, its entries by name
    "verdicts": {
        "as published": verdicts,
        "thresholds and rule": lambda: {
            "numbers": thresholds.NUMBERS, "fixed": thresholds.fixed(study().about),
        },
        "other borders": other_borders,
        "distances of policies": lambda: table(
            paper_claims.policy_distances(every().main.runs, six_paths())
        ),
        "constraints without noise": lambda: paper_claims.kept_without_noise(
            every().main.runs, PAPER
        ).groupby(level="learner", sort=False).agg(["sum", "size"]),
        "costs less than GES": lambda: {
            name: [one(study().main.runs, name, "GES")
                   for one in (own_claims.costs_less, own_claims.costs_less_anew)]
            for name in ("ES", "DES", "RDES", "TDC")
        },
    },
    "study": {
        "robustness map": lambda: robustness.robustness_map(every().runs, six_paths()).set_index(
            ["variant", "claim"]
        ),
        "readings of DES": lambda: robustness.readings_of_des(every().runs, six_paths()),
        "failure modes": lambda: study().runs.groupby(
            ["variant", "learner", "wrong", "mechanism", "ending"], sort=False
        ).size(),
        "answers of thresholds": answers_of_thresholds,
        "the finding": lambda: plain(finding.finding(study()), ROLLOUT),
        "middle of each learner": middle_of_each_learner,
        "shares of the possible": shares_of_the_possible,
        "searches": lambda: {
            f"{layout} 0 2000": {
                "after 200": found.best[bisect(found.rollouts, 200) - 1],
                "made": found.made, "theta": found.theta,
            }
            for layout, found in study().searches.items()
        },
        "ratios of times": lambda: {
            f"{learner}, {solver}": ratio(study().timings, solver, learner)
            for solver, learner in study().timings[["solver", "learner"]].to_numpy()
        },
    },
    "population": {
        "shares": lambda: drawn().shares.set_index("claim"),
        "shares in A to F": shares_in_a_to_f,
        "where each claim holds": lambda: table(population.by_layout(drawn().main, drawn().paths)),
        "answers": lambda: {
            name: answer for name, answer in population.POPULATION.judge(drawn()).items()
            if name != "cliff"
        },
        "the cliff": lambda: plain(population.cliff(population.raised()), RAISED),
        "early overshoot in A to F": lambda: population.early_overshoot(study().main.runs),
        "extrapolation": lambda: interventions.INTERVENTIONS.judge(again()),
        "the raised costs": lambda: plain(population.raised(), RAISED),
        "predictors": predictors,
        "at the gap": lambda: {
            "runs": table(gap()), "improve": drawn_report.improve_by_gap(gap()),
        },
        "whole picture tried": whole_picture_tried,
        "runs made again": runs_made_again,
    },
    "remedies": {
        "answers on remedies": lambda: remedies.REMEDIES.answers(suite()),
        "advice": advice,
        "rows": lambda: remedies.rows(suite()[suite().part != "best"]).to_dict("records"),
        "shares": lambda: {
            plain_name(name): table(remedies.shares(runs))
            for name, runs in suite().groupby(["part", "entry"], sort=False)
        },
        "best settings": lambda: {
            entry: remedies.best_setting(runs)
            for entry, runs in suite()[suite().part == "tune"].groupby("entry", sort=False)
        },
    },
    "agents": {
        "answers on agents": lambda: agents.SAC_AND_TD3.judge((trained(), suite())),
        "answers without the suite": lambda: agents.SAC_AND_TD3.judge((trained(), suite()[:0])),
        "costs of the best search": lambda: {
            part: agents.searched(suite(), part) for part in agents.SEARCHED
        },
        "courses": courses,
    },
    "worlds": {
        "answers on worlds": lambda: worlds.WORLDS.answers(changing()),
        "means": means_in_worlds,
        "shares after a change": lambda: {
            part: worlds.shares(changing(), part).median() for part in worlds.CHANGES
        },
        "carried": lambda: {
            arm: table(worlds.carried(changing(), arm)) for arm in ("ES", "CMA-ES")
        },
        "solved with a terminal cost": lambda: worlds.solved_with(changing()).sum(),
        "saved with a wrong model": lambda: world_report.saved(changing()).groupby(
            level=0, sort=False
        ).median(),
        "rows among moving obstacles": lambda: world_report.moving(changing()),
        "drawn scenarios": lambda: short(plain(SCENARIOS)),
    },
    "problems": {
        "costs": lambda: {
            arm: [interquartile_mean(tests, ["all"] * len(tests)), table(tests)]
            for arm, tests in problems().tests.items()
        },
        "predictions": lambda: other_problems.OTHER_PROBLEMS.answers(
            other_problems.OTHER_PROBLEMS.table()
        ),
        "references": lambda: problems().references,
        "medians": lambda: problems().medians,
        "spread of solvers": lambda: table(problems().spreads.drop(columns="seconds")),
        "sweep of drawn problems": lambda: json.loads(
            (published.folder() / "sweep.json").read_text()
        )["tally"],
    },
    "keys": {"keys": keys, "seeds": seeds},
    "machine": {"abilities": processor},
}  # fmt: skip


if __name__ == "__main__":
    sys.exit(write())
