"""What worlds that move, change, or are not the model say, by `world_questions`.

And what a richer terminal cost is worth, by `terminal_questions`.

All of it is made of one table, a row a run, with `world_runs.COLUMNS`. What is missing is left out.
"""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from nmpcrl.analysis.encounters import crowding
from nmpcrl.analysis.worlds import EVERY, sequence
from nmpcrl.claims.population import Answer, by_share
from nmpcrl.claims.rule import read
from nmpcrl.claims.terminal_questions import ARMS, TERMINAL_QUESTIONS
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome
from nmpcrl.claims.world_questions import (
    ALIGNED,
    BACK,
    CHANGES,
    CLEARLY,
    DEVIATIONS,
    LITTLE,
    MISFIT,
    ORACLES,
    PROMPT,
    RARE,
    REMEDY,
    RESAMPLES,
    SOON,
    VIEWS,
    WITHOUT,
    WORLD_QUESTIONS,
)
from nmpcrl.claims.world_runs import PARTS
from nmpcrl.study.scenarios import load

QUESTIONS = {**WORLD_QUESTIONS, **TERMINAL_QUESTIONS}
EACH = 50  # episodes of a layout in "every 50", which a change that is not noticed counts
AFTER = {  # what is compared where the layout changes every 50 episodes
    "a raised rate": ("ES told raised", "ES told plain"),
    "theta reset": ("ES told reset", "ES told plain"),
    "recent replay in RDES": ("RDES told recent", "RDES told plain"),
    "recent replay in DES": ("DES told recent", "DES told plain"),
    "being told": ("ES told plain", "ES never plain"),
    "detecting": ("ES cost plain", "ES never plain"),
}


def answers(table: pd.DataFrame) -> tuple[Answer, ...]:
    """All of `QUESTIONS`."""
    found = (
        *_moving(table),
        *_model(table),
        _gradient(table),
        *_changing(table),
        _carried(table),
        *terminal(table),
    )
    by = {one.question: one for one in found}
    return tuple(by[name] for name in QUESTIONS)


def means(table: pd.DataFrame, part: str, column: str = "cost") -> pd.DataFrame:
    """The mean over seeds, a row a place and a column an arm; nan where nothing is known."""
    there = table[table.part == part]
    found = there.assign(value=there[column].astype(float))
    by = found.groupby(["place", "arm"], sort=False).value.mean().unstack("arm")
    return by.reindex(columns=PARTS[part].arms)


def _lower(costs: pd.DataFrame, first: str, second: str) -> pd.Series:
    """Whether the first costs less, in the places in which both are known."""
    both = costs[[first, second]].dropna()
    return both[first] < both[second]


def _moving(table: pd.DataFrame) -> Iterable[Answer]:
    costs, inside = means(table, "moving"), means(table, "moving", "inside")
    of = "scenarios"
    init = costs[[f"{view} init" for view in VIEWS]].dropna().set_axis(list(VIEWS), axis=1)
    ratios = {view: init[view] / init["known"] for view in VIEWS[1:]}
    medians = {view: {"median ratio": float(one.median())} for view, one in ratios.items()}
    yield by_share("a velocity is enough", ratios["extrapolated"] <= 1 + CLEARLY, of,
                   medians["extrapolated"])  # fmt: skip
    yield by_share("a frozen view costs more", ratios["frozen"] >= 1 + CLEARLY, of,
                   medians["frozen"])  # fmt: skip
    met = inside[[f"{view} init" for view in VIEWS]].dropna()
    met = met[(met > 0).any(axis=1)]
    yield by_share("collisions", (met.iloc[:, :2] == 0).all(axis=1), of)
    yield _crowding(inside["extrapolated init"].dropna())
    yield by_share("learning among moving obstacles",
                   _lower(costs, "extrapolated ES", "extrapolated init"), of)  # fmt: skip
    yield by_share("learning or looking", _lower(costs, "frozen ES", "extrapolated init"), of)
    yield by_share("one number by hand among moving obstacles",
                   _lower(costs, "extrapolated grid", "extrapolated ES"), of)  # fmt: skip
    both = inside[["extrapolated ES", "extrapolated init"]].dropna()
    yield by_share("safer by learning", _lower(both[(both > 0).any(axis=1)], *both.columns), of)


def _crowding(inside: pd.Series) -> Answer:
    """The rank correlation with its interval."""
    if len(inside) < 10:
        return Answer("crowding", UNDECIDABLE, {"scenarios": (0, len(inside))})
    scenarios = load()
    pairs = np.c_[[crowding(scenarios[str(name)]) for name in inside.index], inside]
    rng = np.random.default_rng(0)
    drawn = [pairs[rng.integers(len(pairs), size=len(pairs))] for _ in range(RESAMPLES)]
    low, high = np.nanquantile([_correlation(one) for one in drawn], [0.025, 0.975])
    outcome: Outcome = REPRODUCED if low > 0 else NOT if high < 0 else PARTLY
    numbers = {"correlation": _correlation(pairs), "low": float(low), "high": float(high)}
    beside = {"scenarios with any": (int((inside > 0).sum()), len(inside))}
    said = "no correlation shown" if outcome == PARTLY else ""
    return Answer("crowding", outcome, numbers=numbers, beside=beside, said=said)


def _correlation(pairs: np.ndarray) -> float:
    """Of the ranks; nan where one of the two does not vary."""
    ranks = rankdata(pairs, axis=0).T
    return float(np.corrcoef(ranks)[0, 1]) if ranks.std(axis=1).all() else np.nan


def _saved(costs: pd.DataFrame, faults: Iterable[str], how: str) -> pd.Series:
    """The share of theta_init's cost that is saved, by fault and layout."""
    found = {fault: 1 - costs[f"{fault} {how}"] / costs[f"{fault} init"] for fault in faults}
    return pd.concat(found).dropna()


def _model(table: pd.DataFrame) -> Iterable[Answer]:
    costs, of = means(table, "model"), "faults and layouts"
    perfect = _saved(costs, ORACLES, "oracle")
    yield by_share("a perfect model", perfect < LITTLE, of,
                   {f"{fault}, median": float(perfect[fault].median()) for fault in ORACLES
                    if fault in perfect})  # fmt: skip
    by_hand = _saved(costs, (*ORACLES, *WITHOUT), "grid")
    yield by_share("misfit of theta_c", by_hand >= MISFIT, of, {"median": float(by_hand.median())})
    adds = {one: _lower(costs, f"{one} ES+model", f"{one} ES") for one in (*ORACLES, *WITHOUT)}
    drift = by_share("only drift adds", adds["drift"], "layouts")
    others = {one: (int(yes.sum()), len(yes)) for one, yes in adds.items() if one != "drift"}
    also = any(read(*others[one]) == REPRODUCED for one in ORACLES if one in others)
    outcome: Outcome = PARTLY if also and drift.outcome == REPRODUCED else drift.outcome
    yield Answer(drift.question, outcome, {**drift.counts, **others})
    both = _saved(costs, ORACLES, "ES").to_frame("ES").join(perfect.rename("oracle")).dropna()
    yield by_share("recovered by weights", both["ES"] > both["oracle"], of)


def _gradient(table: pd.DataFrame) -> Answer:
    cosines = means(table, "gradient")
    numbers = {f"median cosine at {one}": float(cosines[one].median()) for one in DEVIATIONS}
    aligned = cosines["0.05"].dropna() >= ALIGNED
    return by_share("noise and the gradient", aligned, numbers=numbers)


def changes(part: str, place: str) -> list[int]:
    """The episodes that bring a change."""
    _, order = sequence(part, place, PARTS[part].budget)
    return [e for e, (before, after) in enumerate(pairwise(order), start=1) if after != before]


def after(part: str, place: str, shares: list[float]) -> float:
    """The mean share over all rollouts since the first change; nan where there is none."""
    begin = changes(part, place)
    return float(np.mean(shares[begin[0] // EVERY :])) if begin else np.nan


def back(shares: list[float], change: int) -> float:
    """Episodes from a change that is the last until the cost is back; infinite if it is not."""
    first = change // EVERY
    later = np.array(shares[first:]) <= shares[first - 1] + BACK
    failed = np.flatnonzero(~later)
    rollouts = failed[-1] + 1 if failed.size else 0
    return float(np.inf if rollouts == len(later) else EVERY * (rollouts + 1))


def shares(table: pd.DataFrame, part: str) -> pd.DataFrame:
    """`after` by place and arm: the cost since the first change, over theta_init there."""
    there = table[(table.part == part) & ~table.arm.str.startswith(REMEDY)]
    found = [after(part, row.place, row.series) for row in there.itertuples()]
    return means(there.assign(share=found), part, "share")


def _changing(table: pd.DataFrame) -> Iterable[Answer]:
    of, once = "sequences", table[table.part == "once"]
    told = once[once.arm == "ES told plain"]
    until = pd.Series(
        [back(row.series, changes("once", row.place)[0]) for row in told.itertuples()], dtype=float
    )
    yield by_share("back soon", until <= SOON, of, {"median episodes": float(until.median())})
    fifty = shares(table, "every 50")
    for name, (first, second) in AFTER.items():
        medians = {one: float(fifty[one].median()) for one in (first, second)}
        yield by_share(name, _lower(fifty, first, second), of, medians)
    for name, arm in (("a chart on the cost", "ES cost plain"),
                      ("a chart on the TD error", "ES delta plain")):  # fmt: skip
        yield _chart(name, table[(table.part == "every 50") & (table.arm == arm)])
    every = pd.concat([shares(table, part)["ES told plain"] for part in CHANGES], axis=1).dropna()
    mean = every.mean(axis=1)
    numbers = {"median share": float(mean.median()), "largest share": float(mean.max())}
    yield by_share("learning pays in a changing world", mean < 1, of, numbers)
    last = {
        "remedy": once[once.arm.str.startswith(REMEDY)].set_index("place").cost,
        "ES": told.set_index("place").cost,
    }
    yield by_share("begun anew", _lower(pd.DataFrame(last, columns=[*last]), "remedy", "ES"), of)


def _chart(name: str, runs: pd.DataFrame) -> Answer:
    """How soon a chart notices, and how often it errs."""
    noticed = [noticing(changes("every 50", row.place), row.events) for row in runs.itertuples()]
    yes = pd.Series([d <= PROMPT and f <= RARE for d, f in noticed], dtype=bool)
    delay, false = np.median(noticed, axis=0) if noticed else (np.nan, np.nan)
    numbers = {"median delay": float(delay), "median false alarms": float(false)}
    return by_share(name, yes, "sequences", numbers)


def noticing(begin: list[int], alarms: list[int]) -> tuple[float, float]:
    """The median delay of changes, in episodes, and false alarms an episode of a true map."""
    ends = [*begin[1:], PARTS["every 50"].budget]
    delays, false, true = [], sum(one < begin[0] for one in alarms), begin[0]
    for first, end in zip(begin, ends, strict=True):
        there = [one for one in alarms if first <= one < end]
        delays.append(there[0] + 1 - first if there else EACH)
        false += len(there[1:])
        true += end - there[0] - 1 if there else 0
    return float(np.median(delays)), false / true


def carried(table: pd.DataFrame, arm: str) -> pd.DataFrame:
    """What theta costs, over theta_init: by where it was learned, and where it is judged.

    Args:
        table: with `world_runs.COLUMNS`.
        arm: an entry, such as "ES".
    """
    there = table[(table.part == "carry") & table.arm.isin(["frozen", arm])]
    runs = {name: each.set_index("place").series for name, each in there.groupby("arm")}
    if len(runs) < 2:
        return pd.DataFrame()
    shares = np.vstack(runs[arm].to_list()) / np.array(runs["frozen"].iloc[0])
    return pd.DataFrame(shares, runs[arm].index, [*PARTS["carry"].places])


def _carried(table: pd.DataFrame) -> Answer:
    better = {
        arm: pd.Series(
            [(row.drop(place) < 1).mean() for place, row in carried(table, arm).iterrows()]
        )
        for arm in ("ES", "CMA-ES")
    }
    numbers = {f"median share, {arm}": float(one.median()) for arm, one in better.items()}
    return by_share("carried over", better["ES"] > 0.5, "layouts", numbers)


def solved_with(table: pd.DataFrame) -> pd.DataFrame:
    """Whether ES ends at the target at a lower cost under every seed, by layout and terminal cost.

    Args:
        table: with `world_runs.COLUMNS`.
    """
    solved = table.assign(solved=table.arrived.astype(bool) & (table.cost < 1))
    return means(solved, "terminal", "solved") == 1


def terminal(table: pd.DataFrame) -> Iterable[Answer]:
    """What ES with a richer terminal cost does in the compared layouts.

    Args:
        table: with `world_runs.COLUMNS`.
    """
    solved, costs = solved_with(table), means(table, "terminal")
    paper_s, full, learned = ARMS
    for name, arm in (("full terminal cost", full), ("learned terminal cost", learned)):
        known = costs[[paper_s, arm]].dropna().index
        failing = solved.loc[known][~solved.loc[known, paper_s]]
        yield by_share(name, ~failing[arm], "layouts")
    ratio = (costs[learned] / costs[paper_s]).dropna()
    yield by_share("a richer terminal cost pays", ratio < 1, "layouts",
                   {"median ratio": float(ratio.median())})  # fmt: skip
