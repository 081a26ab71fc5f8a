"""What the published files come to, frozen: `python tests/golden/freeze.py` writes it anew.

`FILES` has the entries of each JSON file beside this one, with what computes them from what is
published; nothing is trained. `test_golden` compares all of them with what the library says.
"""

import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from itertools import chain, product
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pandas as pd
from plain_values import array, plain, plain_name, processor, short, table

from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.analysis.suite import seed_of
from nmpcrl.bench.learners import ratio
from nmpcrl.claims import (
    finding,
    own_claims,
    paper_claims,
    prespecified,
    published,
    robustness,
    rule,
    thresholds,
)
from nmpcrl.claims.verdict import REPRODUCED
from nmpcrl.report import drawn as drawn_report
from nmpcrl.report import worlds as world_report
from nmpcrl.studies import (
    agents,
    interventions,
    main_study,
    other_problems,
    population,
    remedies,
    reproduce,
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
raised = cache(population.raised)


def by_question(answers: Iterable[Any]) -> dict[str, Any]:
    """Outcome, counts and numbers of each answer."""
    names = ("outcome", "counts", "numbers", "beside")
    return {one.question: {name: getattr(one, name) for name in names} for one in answers}


def by_claim(verdicts: Iterable[Any]) -> dict[str, Any]:
    """Each verdict, and how many layouts drawn anew would say yes."""
    return {
        one.claim: plain(one)
        | {"halves": {f"{half.wrong}, per {half.decay}": half for half in one.halves}}
        | {"p": [half.p for half in one.halves], "turns": one.turns}
        | {"anew": rule.anew(one) if one.counts else None}
        | {"depends": [one.depends_on("layout"), one.depends_on("decay")]}
        for one in verdicts
    }


def other_borders() -> Any:
    main, known = every().main.runs, {}
    for name, claim in {**paper_claims.BY_RUNS, **own_claims.OWN_CLAIMS}.items():
        runs = main if name in paper_claims.BY_RUNS else study().runs
        if name not in paper_claims.BY_RUNS:
            runs = runs[runs.variant.isin([design.MAIN_TABLE, "controls"])]
        values = claim.measure(runs, six_paths())
        known[name] = {
            "values": table(values),
            "borders": table(claim.at_borders(values, claim.borders)),
            "steady": claim.steady(values),
        }
    return known


def constraints_without_noise() -> Any:
    kept = paper_claims.kept_without_noise(every().main.runs, PAPER)
    return kept.groupby(level="learner", sort=False).agg(["sum", "size"])


def costs_less_than_ges() -> Any:
    others, main = ("ES", "DES", "RDES", "TDC"), study().main.runs
    functions = (own_claims.costs_less, own_claims.costs_less_anew)
    return {name: [one(main, name, "GES") for one in functions] for name in others}


def runs_that_went_wrong() -> Any:
    kinds = {"diverged": thresholds.divergence, "unstable": thresholds.instability}
    runs, found = study().main.runs, {}
    runs = runs[runs.learner.isin(PAPER)]
    for name, wrong in kinds.items():
        cells = runs.assign(wrong=wrong(runs)).pivot_table(
            "wrong", ["decay", "learner"], "layout", "sum", sort=False
        )
        each = runs.groupby(["decay", "learner"]).size()
        found[name] = cells.assign(**{"all layouts": cells.sum(axis=1), "runs": each}).astype(int)
    return found


def answers_of_thresholds() -> Any:
    runs = study().runs
    names = ("was_stopped", "worsens", "improves", "solved", "cost_reduction", "late_cost_range")
    return table(pd.DataFrame({name: getattr(thresholds, name)(runs) for name in names}))


def middle_of_each_learner() -> Any:
    runs = study().main.runs
    left = runs.final_cost.where(runs.stopped == "finished", np.inf) / runs.initial_cost
    groups = runs.groupby("learner").groups.items()
    return {name: interquartile_mean(left[i], list(runs.layout[i])) for name, i in groups}


def share_of_the_possible() -> Any:
    gains = {search.layout: found.gain for search, found in study().searches.items()}
    shares = thresholds.share_of_possible(study().main.runs, gains)
    return shares.groupby(study().main.runs.learner).median()


def searches() -> Any:
    names = ("theta", "made", "initial", "cost", "gain")
    return {
        f"{search.layout} {search.seed} {search.budget}": {
            **{name: getattr(found, name) for name in names},
            "after 200": found.after(200),
        }
        for search, found in study().searches.items()
    }


def ratios_of_times() -> Any:
    pairs = study().timings[["solver", "learner"]].itertuples(index=False, name=None)
    return {
        f"{learner}, {solver}": ratio(study().timings, solver, learner) for solver, learner in pairs
    }


def shares_in_a_to_f() -> Any:
    main, names = study().main.runs, list(population.EXPECTED)
    runs = study().runs[study().runs.variant == design.MAIN_TABLE]
    assert len(main) == len(runs)
    return population.shares(population.by_layout(runs, study().paths, names)).set_index("claim")


def verdicts_that_stand() -> Any:
    outcomes = {one.claim: one.outcome for one in study().verdicts}
    found = drawn().shares
    return {one.claim: outcomes[one.claim] == one.outcome for one in found.itertuples()
            if one.claim in outcomes}  # fmt: skip


def answers() -> Any:
    found = population.POPULATION.judge(drawn())
    return by_question(found[one.name] for one in population.QUESTIONS if one.name != "cliff")


def other_answers() -> Any:
    return {
        "cliff": plain(by_question([named("cliff", population.cliff(raised()))]), RAISED),
        "extrapolation": by_question(interventions.INTERVENTIONS.judge(again()).values()),
        "early overshoot in A to F": by_question(
            [named("early overshoot", population.early_overshoot(study().main.runs))]
        ),
    }


def named(question: str, answer: Any) -> Any:
    return replace(answer, question=question)


def predictors() -> Any:
    parts, layouts = drawn().runs.groupby("part"), drawn().layouts
    tuned, judged = population.succeeds(parts.get_group("tune")), population.succeeds(drawn().main)
    found = predictor_scores(layouts, tuned, judged)
    fitted = ("slope", "brier")  # of which BFGS finds no more digits
    return found.assign(**{name: [plain(one, ROLLOUT) for one in found[name]] for name in fitted})


def successes() -> Any:
    parts = {"main": drawn().main, **dict(iter(drawn().runs.groupby("part", sort=False)))}
    learners = ("ES", "GES")
    return {
        f"{learner}, {part}": [int(yes.sum()), len(yes), array(yes.to_numpy(bool))]
        for (part, runs), learner in product(parts.items(), learners)
        if len(yes := population.succeeds(runs, learner))
    }


def at_the_gap() -> Any:
    ends = drawn_report.at_the_gap(drawn())
    return {"runs": table(ends), "improve": drawn_report.improve_by_gap(ends)}


def whole_picture_tried() -> Any:
    tried = drawn().tried
    columns = ["setting", "layout", "decay", *population.PICTURE, "whole", "answers"]
    return {
        "cells": table(tried),
        "by setting": tried.groupby(["setting", "whole"], sort=False).size(),
        "nearest": tried[columns].head(5),
    }


def runs_made_again() -> Any:
    asked = [("true slope", "none"), ("theta held", "none"), ("nudged", "none")]
    asked += [("true slope", "nudged"), ("theta held", "nudged")]
    return {
        f"{part}: {arm}, {than}": interventions.live(runs, arm, than)
        for part, runs in again().groupby("part", sort=False)
        for arm, than in asked
    }


def by_field(row: Any) -> dict[str, Any]:
    """The fields of a `RemedyRow` by name."""
    return {name: getattr(row, name) for name in remedies.RemedyRow._fields}


def advice() -> Any:
    by_entry = remedies.advice(suite()).groupby("entry", sort=False)
    return {
        f"{i:02} {entry}": {
            "entry": entry,
            "word": each.word.iloc[0],
            "tuning": each.tuning.iloc[0],
            "rows": {one.part: by_field(one) for one in each.itertuples()},
        }
        for i, (entry, each) in enumerate(by_entry, start=1)
    }


def what_was_expected() -> Any:
    advised = remedies.advice(suite())
    return remedies.expectations(advised) | {"greatest": remedies.greatest(advised)}


def shares_in_named_layouts() -> Any:
    there = suite()[suite().part.str.startswith("named")]
    groups = there.groupby(["part", "entry"], sort=False)
    return {plain_name(name): remedies.shares(runs) for name, runs in groups}


def courses() -> Any:
    found = {}
    asked = [("judge", ()), ("one", ()), ("all", ()), ("all", [*TUNE]), ("all", [*JUDGE])]
    for (part, among), agent in product(asked, agents.AGENTS):
        one = agents.course(trained(), part, agent, among)
        if len(one.last):
            found[f"{agent}, {part}, {len(one.last)}"] = {
                "episodes": one.episodes,
                "median": one.median,
                "interval": one.interval,
                "matched": one.matched,
                "shares": array(one.shares.to_numpy()),
                "there": one.there.mean(axis=1).to_numpy(),
            }
    return found


def of_worlds(of: Callable[[pd.DataFrame], Any]) -> dict[str, Any]:
    """What comes of the means of each column in each part of the worlds that change."""
    columns = ("cost", "inside", "arrived")
    return {
        f"{part}, {column}": of(worlds.means(changing(), part, column))
        for part, column in product(worlds.PARTS, columns)
    }


def saved_with_a_wrong_model() -> Any:
    found = world_report.saved(changing()).groupby(level=0, sort=False)
    return {fault: each.median().dropna().to_dict() for fault, each in found}


def rows_among_moving_obstacles() -> Any:
    found = world_report.moving(changing()).rename(columns={"saved": "gain"})
    return {plain_name(name): row[["clear", "gain", "solved"]].to_dict()
            for name, row in found.iterrows()}  # fmt: skip


def costs() -> Any:
    return {
        arm: {
            "middle": interquartile_mean(tests, ["all"] * len(tests)),
            "median": float(np.median(tests)),
            "ended": int(np.isfinite(tests).sum()),
            "tests": array(tests),
        }
        for arm, tests in problems().tests.items()
    }


def predictions() -> Any:
    answers = other_problems.OTHER_PROBLEMS.answers(other_problems.OTHER_PROBLEMS.table())
    return {name: one.outcome == REPRODUCED for name, one in answers.items()}


def references() -> Any:
    rows = other_problems.OTHER_PROBLEMS.table().query("part == 'references'").set_index("arm")
    return {**problems().references, "theta": rows.theta["best_theta"]}


def spread_of_solvers() -> Any:
    runs = problems().spreads
    frame = runs[["before", "nudged", "after"]].copy()
    for solver in other_problems.PEERS:
        frame[solver] = runs[solver]
        frame[f"{solver}, steps"] = runs[f"steps of {solver}"]
    gaps = np.array([*runs.gap])
    return {"median": frame.median(), "mean": frame.mean(), "gap": np.median(gaps, axis=0)}


# What names a run: no edit may change a key, or stored runs would be trained again.


@cache
def keys_of_runs() -> dict[Any, tuple[str, str]]:
    """Keys of each run of the study and of its summary, with what made the first of them."""
    first = study().batches[0]
    with (
        mock.patch.object(provenance, "installed", first["versions"].__getitem__),
        mock.patch.object(provenance, "EPOCHS", first["epochs"]),
    ):
        return {e: (provenance.key(e), provenance.summary_key(e)) for e in design.whole_study()}


def keys() -> Any:
    parts, wanted = design.whole_study(), dict.fromkeys(reproduce.sample(study().variants, 60))
    first = {part: e for e, part in reversed(parts.items())}
    some = (
        design.main_table(layouts=["A"], seeds=[0, 1, 2]),
        design.main_table(layouts=["B", "E"], decays=["step"], seeds=[0]),
        design.main_table(layouts=["C", "D", "F"], decays=["episode"], seeds=[0]),
    )
    wanted |= dict.fromkeys([*chain.from_iterable(some), *first.values()])
    known = keys_of_runs()
    return {
        f"{parts[e]}: {e.learner} {e.layout} {e.decay} {e.seed}": [one[:16] for one in known[e]]
        for e in wanted
    }


def all_keys() -> Any:
    known, rows = keys_of_runs(), study().rows
    return {
        "runs": len(known),
        "as published": sum(rows[e]["key"] == one for e, (_, one) in known.items() if e in rows),
        "all, in their order": short([*known.values()]),
    }


def seeds() -> Any:
    named = (*LAYOUTS, *paper.LAYOUTS)
    where = {part: [*one.places] for part, one in worlds.PARTS.items()}
    return {
        "remedies": short([seed_of(place, 0) for place in named]),
        "agents": [agents.seed_of(place, 1) for place in (agents.EVERY, "A", "J001")],
        "worlds": {part: short([worlds.WORLDS.seed(place, 1) for place in places])
                   for part, places in where.items()},
    }  # fmt: skip


FILES: dict[str, dict[str, Callable[[], Any]]] = {  # by file, its entries by name
    "verdicts": {
        "as published": lambda: by_claim(study().verdicts),
        "thresholds and rule": lambda: {
            "numbers": prespecified.NUMBERS, "fixed": prespecified.fixed(study().about),
        },
        "other borders": other_borders,
        "distances of policies": lambda: table(
            paper_claims.policy_distances(every().main.runs, six_paths())
        ),
        "constraints without noise": constraints_without_noise,
        "costs less than GES": costs_less_than_ges,
    },
    "study": {
        "robustness map": lambda: robustness.robustness_map(every().runs, six_paths()).set_index(
            ["variant", "claim"]
        ),
        "readings of DES": lambda: robustness.readings_of_des(every().runs, six_paths()),
        "failure modes": lambda: study().runs.groupby(
            ["variant", "learner", "wrong", "mechanism", "ending"], sort=False
        ).size(),
        "runs that went wrong": runs_that_went_wrong,
        "answers of thresholds": answers_of_thresholds,
        "the finding": lambda: plain(finding.finding(study()), ROLLOUT),
        "middle of each learner": middle_of_each_learner,
        "share of the possible": share_of_the_possible,
        "searches": searches,
        "ratios of times": ratios_of_times,
    },
    "population": {
        "shares": lambda: drawn().shares.set_index("claim"),
        "shares in A to F": shares_in_a_to_f,
        "where each claim holds": lambda: table(population.by_layout(drawn().main, drawn().paths)),
        "verdicts that stand": verdicts_that_stand,
        "answers": answers,
        "other answers": other_answers,
        "the raised costs": lambda: plain(raised(), RAISED),
        "predictors": predictors,
        "successes": successes,
        "at the gap": at_the_gap,
        "whole picture tried": whole_picture_tried,
        "runs made again": runs_made_again,
    },
    "remedies": {
        "answers on remedies": lambda: by_question(remedies.REMEDIES.answers(suite()).values()),
        "advice": advice,
        "what was expected": what_was_expected,
        "rows": lambda: {
            part: {one.entry: by_field(one) for one in remedies.rows(suite()[suite().part == part])}
            for part in [*remedies.PARTS][1:]
        },
        "shares in named layouts": shares_in_named_layouts,
        "best settings": lambda: {
            entry: remedies.best_setting(runs)
            for entry, runs in suite()[suite().part == "tune"].groupby("entry", sort=False)
        },
    },
    "agents": {
        "answers on agents": lambda: by_question(
            agents.SAC_AND_TD3.judge((trained(), suite())).values()
        ),
        "answers without the suite": lambda: {
            name: one.outcome
            for name, one in agents.SAC_AND_TD3.judge((trained(), suite()[:0])).items()
        },
        "costs of the best search": lambda: {
            part: agents.searched(suite(), part) for part in agents.SEARCHED
        },
        "courses": courses,
    },
    "worlds": {
        "answers on worlds": lambda: by_question(worlds.WORLDS.answers(changing()).values()),
        "medians": lambda: of_worlds(lambda means: means.median()),
        "means": lambda: of_worlds(table),
        "shares after a change": lambda: {
            part: worlds.shares(changing(), part).median() for part in worlds.CHANGES
        },
        "carried": lambda: {
            arm: table(worlds.carried(changing(), arm)) for arm in ("ES", "CMA-ES")
        },
        "solved with a terminal cost": lambda: worlds.solved_with(changing()).sum(),
        "saved with a wrong model": saved_with_a_wrong_model,
        "rows among moving obstacles": rows_among_moving_obstacles,
        "drawn scenarios": lambda: {"count": len(SCENARIOS), "all": short(plain(SCENARIOS))},
    },
    "problems": {
        "costs": costs,
        "predictions": predictions,
        "references": references,
        "spread of solvers": spread_of_solvers,
        "sweep of drawn problems": lambda: json.loads(
            (published.folder() / "sweep.json").read_text()
        )["tally"],
    },
    "keys": {"keys": keys, "all keys": all_keys, "seeds": seeds},
    "machine": {"abilities": processor},
}  # fmt: skip


if __name__ == "__main__":
    sys.exit(write())
