"""Obstacles that move, a wrong model, layouts that change, richer terminal costs: 28 questions.

Parts, thresholds and questions, in `worlds.toml`, were committed before any row was made; a test
compares them with that commit, whose files also have the measure of each question and its border.

A place (a scenario, a layout, a sequence of layouts) is the unit: seeds are averaged first, and
intervals are over places. Two arms with one seed meet the same noise. Costs are of rollouts without
noise on the action; a failed solve costs infinitely much. In a layout that changes the cost is a
share of theta_init's in the same layout, told of the change: 1 is replanning without learning.
"""

from collections.abc import Callable, Iterable
from functools import partial
from itertools import pairwise, product
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from nmpcrl.analysis.encounters import crowding
from nmpcrl.analysis.suite import scenario_seed
from nmpcrl.claims.rule import read
from nmpcrl.claims.verdict import PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies import investigation
from nmpcrl.studies import worlds_run as runs
from nmpcrl.studies.investigation import (
    Answer,
    Investigation,
    Part,
    above,
    cheaper,
    lower,
    questions,
    share,
)
from nmpcrl.studies.shifts import EVERY, sequence, shifting
from nmpcrl.studies.worlds_run import TERMINALS
from nmpcrl.study.drawn import COMPARED, JUDGE, SCENARIOS

BACK = 0.02  # of theta_init's cost: a share that exceeds the one before a change by less is back
SOON = 50  # episodes: "back" within so many is soon
CLEARLY = 0.1  # share by which one view must cost more than another for that to be clear
LITTLE = 0.02  # of theta_init's cost: a perfect model is worth little if it saves less
MISFIT = 0.05  # of theta_init's cost: the least that the pilot's theta_c saved
ALIGNED = 0.9  # cosine of two steps that point the same way
PROMPT = 10  # episodes: a change is noticed promptly within so many
RARE = 0.01  # false alarms an episode, at most
EACH = 50  # episodes of a layout in "every 50", the delay of a missed change
RESAMPLES = 2000  # of the bootstrap over places

VIEWS = ("known", "extrapolated", "frozen")
ORACLES = ("speed", "turn", "drift", "slip")  # faults of which an oracle knows the model
FAULTS = (*ORACLES, "lag", "noise")
DEVIATIONS = ("0.02", "0.05", "0.1")  # [m] and [rad], of the measured state
CHANGES = ("once", "every 50", "random")
REMEDY = "Bayes[nearby=2]"  # the entry that the comparison of remedies says to try first

LAYOUTS, SEQUENCES = tuple(JUDGE), tuple(f"S{i:02}" for i in range(1, 11))


def grid(*words: Iterable[str]) -> dict[str, Any]:
    """Every combination of words as a setting, by its name: "known init"."""
    return {" ".join(each): each for each in product(*words)}


CHANGING = {
    **grid(["ES"], ["told", "cost", "delta", "never"], ["plain"]),
    **grid(["ES"], ["told", "cost"], ["raised", "reset"]),
    **grid(["RDES", "DES"], ["told"], ["plain", "recent"]),
    **grid(["frozen"], ["cost", "delta", "never"], ["plain"]),
}
PARTS = {
    "moving": Part(
        runs.moving, grid(VIEWS, ["init", "grid", "CMA-ES", "ES"]), tuple(SCENARIOS), 50, seeds=5,
        deterministic=tuple(grid(VIEWS, ["init", "grid"])),
    ),
    "model": Part(
        runs.model,
        grid(FAULTS, ["init", "grid", "ES", "ES+model"]) | grid(ORACLES, ["oracle", "oracle+ES"]),
        LAYOUTS[:12], 100, seeds=2,
        deterministic=(*grid(FAULTS, ["init", "grid"]), *grid(ORACLES, ["oracle"])),
    ),
    "once": Part(partial(shifting, "once"), CHANGING | grid(["remedy"], [REMEDY]), SEQUENCES, 300),
    "every 50": Part(partial(shifting, "every 50"), CHANGING, SEQUENCES, 300),
    "random": Part(partial(shifting, "random"), CHANGING, SEQUENCES, 300),
    "carry": Part(
        runs.carry, {one: one for one in ("frozen", "ES", "CMA-ES")}, LAYOUTS, 300,
        first={"frozen": 1},
    ),
    "gradient": Part(runs.gradient, {one: float(one) for one in DEVIATIONS}, LAYOUTS[:20], 20),
    "terminal": Part(runs.terminal, {one: one for one in TERMINALS}, COMPARED, 300, seeds=2),
}  # fmt: skip


def means(table: pd.DataFrame, part: str, column: str = "cost") -> pd.DataFrame:
    """As `investigation.means`, with a column for every arm of the part."""
    found = investigation.means(table, part, column)
    return found.reindex(columns=[*PARTS[part].settings(table)])


def _view(view: str, yes: Callable[[pd.Series], pd.Series], table: pd.DataFrame) -> Answer:
    """Asked of theta_init's cost with a view, over its cost with the motion known."""
    init = means(table, "moving")[[f"{view} init" for view in VIEWS]].dropna()
    ratio = init[f"{view} init"] / init["known init"]
    return share(yes(ratio), "scenarios", {"median ratio": float(ratio.median())})


def _inside(arms: list[str], yes: Callable[..., pd.Series], table: pd.DataFrame) -> Answer:
    """Asked of the states inside an obstacle, in scenarios where an arm has any."""
    inside = means(table, "moving", "inside")[arms].dropna()
    met = inside[(inside > 0).any(axis=1)]
    return share(yes(*(met[arm] for arm in arms)), "scenarios")


def _crowded(table: pd.DataFrame) -> Answer:
    """Whether crowding and states inside an obstacle have a rank correlation above 0."""
    inside = means(table, "moving", "inside")["extrapolated init"].dropna()
    if len(inside) < 10:
        return Answer(UNDECIDABLE, {"scenarios": (0, len(inside))})
    pairs = np.c_[[crowding(SCENARIOS[str(name)]) for name in inside.index], inside]
    rng = np.random.default_rng(0)
    drawn = [pairs[rng.integers(len(pairs), size=len(pairs))] for _ in range(RESAMPLES)]
    low, high = np.quantile([_correlation(one) for one in drawn], [0.025, 0.975])
    outcome = above(low, high)
    numbers = {"correlation": _correlation(pairs), "low": float(low), "high": float(high)}
    beside = {"scenarios with any": (int((inside > 0).sum()), len(inside))}
    said = "no correlation shown" if outcome == PARTLY else ""
    return Answer(outcome, numbers=numbers, beside=beside, said=said)


def _correlation(pairs: np.ndarray) -> float:
    """The correlation of ranks; 0 where one column is constant."""
    ranks = rankdata(pairs, axis=0).T
    return float(np.corrcoef(ranks)[0, 1]) if ranks.std(axis=1).all() else 0.0


def saved(table: pd.DataFrame, policy: str) -> pd.Series:
    """The share of theta_init's cost that a policy saves, by fault and layout."""
    costs = means(table, "model")
    faults = (fault for fault in FAULTS if f"{fault} {policy}" in costs)
    each = {one: 1 - costs[f"{one} {policy}"] / costs[f"{one} init"] for one in faults}
    return pd.concat(each).dropna()


def _perfect(table: pd.DataFrame) -> Answer:
    by_fault = saved(table, "oracle")
    medians = by_fault.groupby(level=0, sort=False).median()
    numbers = {f"{fault}, median": float(each) for fault, each in medians.items()}
    return share(by_fault < LITTLE, "faults and layouts", numbers)


def _recovered(table: pd.DataFrame) -> Answer:
    both = pd.DataFrame({how: saved(table, how) for how in ("ES", "oracle")}).dropna()
    return share(both.oracle < both.ES, "faults and layouts")


def _only_drift(table: pd.DataFrame) -> Answer:
    """Confirmed for drift; in part if confirmed for another fault that an oracle knows as well."""
    counts = {
        fault: lower("model", f"{fault} ES+model", f"{fault} ES")(table).counts["layouts"]
        for fault in FAULTS
    }
    outcomes = {fault: read(*counts[fault]) for fault in ORACLES}
    outcome = outcomes.pop("drift")
    others = REPRODUCED in outcomes.values()
    strict = PARTLY if others and outcome == REPRODUCED else outcome
    return Answer(strict, {"layouts": counts.pop("drift"), **counts})


def _aligned(table: pd.DataFrame) -> Answer:
    cosines = means(table, "gradient")
    numbers = {f"median cosine at {one}": float(cosines[one].median()) for one in DEVIATIONS}
    return share(cosines["0.05"].dropna() >= ALIGNED, numbers=numbers)


def changes(part: str, place: str) -> list[int]:
    """The first episode of each new layout."""
    _, order = sequence(part, place, PARTS[part].episodes)
    return (np.flatnonzero(np.diff(order)) + 1).tolist()


def shares(table: pd.DataFrame, part: str) -> pd.DataFrame:
    """The mean share over all rollouts since the first change, a row a place, a column an arm."""
    rows = table[(table.part == part) & table.arm.isin([*CHANGING])]
    begin = {place: changes(part, place)[0] // EVERY for place in rows.place.unique()}
    found = [np.mean(row.series[begin[row.place] :]) for row in rows.itertuples()]
    return means(rows.assign(share=found), part, "share")


def _since(first: str, second: str, table: pd.DataFrame) -> Answer:
    both = shares(table, "every 50")[[first, second]].dropna()
    medians = {one: float(both[one].median()) for one in (first, second)}
    return share(both[first] < both[second], "sequences", medians)


def back(series: list[float], change: int) -> float:
    """Episodes from the last change until the cost is back; infinite if it is not."""
    first = change // EVERY
    failed = np.flatnonzero(~(np.array(series[first:]) <= series[first - 1] + BACK))
    rollouts = failed[-1] + 1 if failed.size else 0
    return float(np.inf if rollouts == len(series) - first else EVERY * (rollouts + 1))


def _back_soon(table: pd.DataFrame) -> Answer:
    rows = table[(table.part == "once") & (table.arm == "ES told plain")]
    found = [back(row.series, changes("once", row.place)[0]) for row in rows.itertuples()]
    until = pd.Series(found, dtype=float)
    return share(until <= SOON, "sequences", {"median episodes": float(until.median())})


def noticing(begin: list[int], alarms: list[int]) -> tuple[float, float]:
    """The median delay of changes, in episodes, and false alarms an episode of a true map."""
    delays, false, true = [], sum(one < begin[0] for one in alarms), begin[0]
    for first, end in pairwise([*begin, PARTS["every 50"].episodes]):
        there = [one for one in alarms if first <= one < end]
        delays.append(there[0] + 1 - first if there else EACH)
        false += len(there[1:])
        true += end - there[0] - 1 if there else 0
    return float(np.median(delays)), false / true


def _chart(arm: str, table: pd.DataFrame) -> Answer:
    rows = table[(table.part == "every 50") & (table.arm == arm)]
    found = pd.DataFrame(
        [noticing(changes("every 50", row.place), row.events) for row in rows.itertuples()],
        columns=["median delay", "median false alarms"], dtype=float,
    )  # fmt: skip
    delay, false = (found[name] for name in found)
    return share((delay <= PROMPT) & (false <= RARE), "sequences", found.median().to_dict())


def _pays(table: pd.DataFrame) -> Answer:
    every = pd.concat([shares(table, part)["ES told plain"] for part in CHANGES], axis=1).dropna()
    mean = every.mean(axis=1)
    numbers = {"median share": float(mean.median()), "largest share": float(mean.max())}
    return share(mean < 1, "sequences", numbers)


def carried(table: pd.DataFrame, arm: str) -> pd.DataFrame:
    """The cost of theta over theta_init's: a row where theta was learned, a column where judged."""
    rows = table[table.part == "carry"].set_index(["arm", "place"]).series
    if not {arm, "frozen"} <= {*rows.index.get_level_values("arm")}:
        return pd.DataFrame()
    ratios = np.vstack(rows[arm].to_list()) / np.array(rows["frozen"].iloc[0])
    return pd.DataFrame(ratios, rows[arm].index, [*PARTS["carry"].places])


def _carries(table: pd.DataFrame) -> Answer:
    better = {}
    for arm in ("ES", "CMA-ES"):
        rows = carried(table, arm).iterrows()
        better[arm] = pd.Series([(row.drop(place) < 1).mean() for place, row in rows], dtype=float)
    numbers = {f"median share, {arm}": float(one.median()) for arm, one in better.items()}
    return share(better["ES"] > 0.5, "layouts", numbers)


def solved_with(table: pd.DataFrame) -> pd.DataFrame:
    """Whether ES ends at the target at no higher cost under every seed, by layout and terminal."""
    solved = table.assign(solved=table.arrived.astype(bool) & (table.cost <= 1))
    return means(solved, "terminal", "solved") == 1


def _still_fails(kind: str, table: pd.DataFrame) -> Answer:
    """Asked of the layouts where ES fails with the paper's terminal cost."""
    known = means(table, "terminal")[[TERMINALS[0], kind]].dropna().index
    solved = solved_with(table).loc[known]
    return share(~solved[kind][~solved[TERMINALS[0]]])


QUESTIONS = questions(__file__, {
    "a velocity is enough": partial(_view, "extrapolated", lambda ratio: ratio <= 1 + CLEARLY),
    "a frozen view costs more": partial(_view, "frozen", lambda ratio: ratio >= 1 + CLEARLY),
    "collisions": partial(_inside, [f"{view} init" for view in VIEWS],
                          lambda one, two, _: one + two == 0),
    "crowding": _crowded,
    "learning among moving obstacles":
        lower("moving", "extrapolated ES", "extrapolated init", "scenarios"),
    "learning or looking": lower("moving", "frozen ES", "extrapolated init", "scenarios"),
    "one number by hand among moving obstacles":
        lower("moving", "extrapolated grid", "extrapolated ES", "scenarios"),
    "safer by learning": partial(_inside, ["extrapolated ES", "extrapolated init"],
                                 lambda es, init: es < init),
    "a perfect model": _perfect,
    "misfit of theta_c": lambda table: share(
        (gain := saved(table, "grid")) >= MISFIT, "faults and layouts",
        {"median": float(gain.median())}),
    "only drift adds": _only_drift,
    "recovered by weights": _recovered,
    "noise and the gradient": _aligned,
    "back soon": _back_soon,
    "a raised rate": partial(_since, "ES told raised", "ES told plain"),
    "theta reset": partial(_since, "ES told reset", "ES told plain"),
    "recent replay in RDES": partial(_since, "RDES told recent", "RDES told plain"),
    "recent replay in DES": partial(_since, "DES told recent", "DES told plain"),
    "being told": partial(_since, "ES told plain", "ES never plain"),
    "detecting": partial(_since, "ES cost plain", "ES never plain"),
    "a chart on the cost": partial(_chart, "ES cost plain"),
    "a chart on the TD error": partial(_chart, "ES delta plain"),
    "learning pays in a changing world": _pays,
    "begun anew": lower("once", f"remedy {REMEDY}", "ES told plain", "sequences"),
    "carried over": _carries,
    "full terminal cost": partial(_still_fails, "full"),
    "learned terminal cost": partial(_still_fails, "learned"),
    "a richer terminal cost pays": lambda table: cheaper(
        (means(table, "terminal")["learned"] / means(table, "terminal")[TERMINALS[0]]).dropna()),
})  # fmt: skip

WORLDS = Investigation(
    name="worlds",
    parts=PARTS,
    questions=QUESTIONS,
    seed=scenario_seed,
    registered="cff09a0",  # the three questions on terminal costs: ff05118
    libraries=("cma", "optuna"),
    digits=5,
    prepare=runs.compile_ahead,
)
