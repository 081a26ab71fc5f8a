"""21 learners, remedies and searches at equal interaction: what to try where learning fails.

Settings, parts, the rule of the advice and questions, in `remedies.toml`, were committed before any
entry was tuned or judged; the file of that commit has the measure of each question, and the
pilots known then.

An entry begins from theta_init with 50 or 300 episodes a layout and seed. An entry with settings
tries four of them in the layouts of `tune`, the default first; the one with the greatest gain is
judged.

The **gain** is the share of the possible one, (J_init - J) / (J_init - J_best), of rollouts without
noise: the interquartile mean over layouts of the mean over seeds, with an interval of 95 % by a
bootstrap over layouts. J_best is the lowest cost in a CMA-ES of `YARDSTICK` rollouts, so that a
share may exceed 1. Layouts where less than `LEAST_GAIN` of J_init can be gained have no share. A
failed solve costs infinitely much.

The part `best` searches for J_best, which all other rows have as a column.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis import suite
from nmpcrl.analysis.statistics import Estimate, count, interquartile_mean, rate
from nmpcrl.analysis.suite import ENTRIES, Entry, judge, seed_of
from nmpcrl.claims.rule import MAJORITY
from nmpcrl.claims.verdict import PARTLY, UNDECIDABLE
from nmpcrl.studies.investigation import (
    Answer,
    Condition,
    Investigation,
    Part,
    Row,
    above,
    questions,
    share,
)
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.refusal import Refusal

Setting: TypeAlias = tuple[Entry, Mapping[str, float]]  # an entry, and J_best of each layout

YARDSTICK, YARDSTICK_SEED = 1000, 9_000_000  # rollouts of the search for J_best, its seed
LEAST_GAIN = 0.005  # of J_init; where less is possible, the share would be noise
HALF = 0.5  # of the layouts; an entry that surely solves fewer is never advised
DIGITS = 2  # of the ends of intervals that are compared
NEARLY = 0.9  # of the possible gain, in "search nears the best"
CONTROL = "frozen"  # the entry without advice
NO_DIFFERENCE = "no difference shown"  # where the interval holds 0
SECONDS = 0.013  # of processor time an episode, as long as no row of the entry is known
_STEP_SIZES = tuple({"alpha": alpha} for alpha in (1e-7, 3e-8, 3e-7, 1e-6))
_RADII = tuple({"radius": radius} for radius in (0.3, 0.1, 0.03, 1.0))
SETTINGS: Mapping[str, tuple[Mapping[str, float], ...]] = {  # beta keeps its ratio to alpha
    "frozen": (),
    "grid": (),
    **dict.fromkeys(("ES", "GES", "TDC", "RDES", "DES"), _STEP_SIZES),
    "TDRC": tuple(
        {"alpha": alpha, "regularisation": decay} for decay in (1.0, 1e6) for alpha in (1e-7, 3e-7)
    ),
    **dict.fromkeys(("GES-3", "guarded-ES", "guarded-RDES", "control-RDES"), _STEP_SIZES),
    **dict.fromkeys(("averaged-ES", "undone-ES"), _STEP_SIZES),
    **dict.fromkeys(("undone-LSTD-Q", "GN-J", "undone-GN-J", "DPG"), _RADII),
    "SPSA": (
        {"step": 0.1, "perturbed": 0.05},
        {"step": 0.03, "perturbed": 0.05},
        {"step": 0.3, "perturbed": 0.05},
        {"step": 0.1, "perturbed": 0.15},
    ),
    "CMA-ES": tuple({"spread": spread} for spread in (0.3, 0.1, 0.05, 0.6)),
    "Bayes": tuple({"nearby": nearby} for nearby in (1.0, 0.5, 0.25, 2.0)),
}
CONTROLS = ("guarded-RDES", "control-RDES")  # of the effect of a guard
DEAR = ("RDES", "DES", "GN-J", "undone-GN-J", "DPG")  # more than a second a layout at 50


def arms(entry: str) -> dict[str, Entry]:
    """An entry with each of its settings, by name, the default first."""
    every = (ENTRIES[entry].with_settings(**one) for one in SETTINGS[entry] or ({},))
    return {str(one): one for one in every}


def tuned(table: pd.DataFrame) -> list[Entry]:
    """Every entry with its best setting; a Refusal while a row of its tuning is missing."""
    tune, found = table[table.part == "tune"], []
    for entry, settings in SETTINGS.items():
        runs = tune[tune.entry == entry]
        if len(runs) < len(settings) * len(PARTS["tune"].places):
            raise Refusal(f"{entry} is not tuned yet: the part 'tune' comes first")
        found.append(arms(entry)[best_setting(runs) if settings else entry])
    return found


def best_setting(runs: pd.DataFrame) -> str:
    """The arm of an entry with the greatest gain in the part `tune`, of equal ones the first."""
    gains = {str(arm): gain(shares(each)).value for arm, each in runs.groupby("arm", sort=False)}
    return max(gains, key=lambda arm: gains[arm])


def run(setting: Setting, place: str, episodes: int, seed: int) -> Row:
    """The judgement of an entry in a layout, beside J_best."""
    entry, best = setting
    found = asdict(judge(entry, place, seed, episodes))
    del found["inside"]  # no obstacle moves
    return {"entry": entry.name, "best": best.get(place, found["cost"]), **found}


def _part(
    entries: Callable[[pd.DataFrame], Iterable[Entry]],
    places: Sequence[str],
    episodes: int,
    seeds: int = 1,
    first: Mapping[str, int] | None = None,
) -> Part:
    """A part whose rows need J_best of its layouts; `first` has the number of places by entry."""

    def settings(table: pd.DataFrame) -> dict[str, Setting]:
        best = table.groupby("place").best.first() if len(table) else {}
        for place in places:
            if place not in best:
                raise Refusal(f"J_best of {place} is not known yet: the part 'best' comes first")
        costs = {place: float(best[place]) for place in places}
        return {str(one): (one, costs) for one in entries(table)}

    fewer = {arm: count for entry, count in (first or {}).items() for arm in arms(entry)}
    return Part(run, settings, places, episodes, seeds, first=fewer, seconds=SECONDS)


_TUNED, _JUDGED, _NAMED = tuple(TUNE)[:15], tuple(JUDGE), tuple("ABCDEF")
_NONE = dict.fromkeys(CONTROLS, 0)
_SEARCH = {"CMA-ES": (ENTRIES["CMA-ES"], dict[str, float]())}
PARTS: Mapping[str, Part] = {
    "best": Part(
        lambda setting, place, episodes, _: run(setting, place, episodes, YARDSTICK_SEED),
        _SEARCH,
        (*_TUNED, *_JUDGED, *_NAMED),
        YARDSTICK,
        seconds=SECONDS,
    ),
    "tune": _part(
        lambda _: [one for entry in SETTINGS if SETTINGS[entry] for one in arms(entry).values()],
        _TUNED,
        50,
    ),
    "judge 50": _part(tuned, _JUDGED, 50, 2, {"GN-J": 60}),
    "judge 300": _part(tuned, _JUDGED[:60], 300, 1, {**dict.fromkeys(DEAR, 20), **_NONE}),
    "named 50": _part(tuned, _NAMED, 50, 10),
    "named 300": _part(tuned, _NAMED, 300, 2, {**dict.fromkeys(DEAR, 0), **_NONE}),
}
ADVISED = ("judge 50", "judge 300")  # the parts whose rows are advised on


def _compile_ahead(missing: Iterable[tuple[Condition, Setting]]) -> None:
    """Call each kind of entry once, so that no row's time includes a compilation."""
    for name in dict.fromkeys(entry.name for _, (entry, _) in missing):
        judge(ENTRIES[name], "J001", 0, 3)


def shares(runs: pd.DataFrame) -> pd.Series:
    """The share of the possible gain by layout, for one arm in one part; -inf where it failed."""
    there = runs[runs.initial - runs.best >= LEAST_GAIN * runs.initial]
    each = (there.initial - there.cost) / (there.initial - there.best)
    return each.groupby(there.place, sort=False).mean()


def solved(runs: pd.DataFrame) -> pd.Series:
    """Whether each layout is solved, under every seed."""
    return suite.solved(runs).groupby(runs.place, sort=False).all()


def gain(by_layout: pd.Series) -> Estimate:
    """The interquartile mean over layouts, with its interval; nan where no layout is known."""
    if by_layout.empty:
        return Estimate(np.nan, np.nan, np.nan)
    return interquartile_mean(by_layout.to_numpy(), ["layouts"] * len(by_layout))


def rows(runs: pd.DataFrame) -> pd.DataFrame:
    """The result of each entry in each part of a table, in the order of the table.

    Columns part, entry, name (with its settings), gain (an `Estimate`), solved (the share of the
    layouts, an `Estimate`), layouts, left_out (layouts without a share), rollouts (of a layout and
    seed at most, confirming ones and a tuner's included), seconds (of processor time, mean of a
    layout and seed) and disqualified (whether too many were begun somewhere).
    """
    found = []
    for (part, entry), each in runs.groupby(["part", "entry"], sort=False):
        gained, well = shares(each), solved(each)
        found.append(
            {
                "part": part,
                "entry": entry,
                "name": each.arm.iloc[0],
                "gain": gain(gained),
                "solved": rate(*count(well)),
                "layouts": len(well),
                "left_out": len(well) - len(gained),
                "rollouts": int(each.episodes.max()),
                "seconds": float(each.seconds.mean()),
                "disqualified": bool(each.over.any()),
            }
        )
    return pd.DataFrame(found)


def _runs(table: pd.DataFrame, part: str, entry: str) -> pd.DataFrame:
    return table[(table.part == part) & (table.entry == entry)]


FIRST, SECOND, LATER, OPEN, NEVER = "first", "second", "later", "open", "never"
ADVICE: Mapping[str, str] = {  # in the order in which they are asked; `frozen` is not advised on
    NEVER: "at every budget at which it is judged, the share of the possible gain lies below 0 with"
    f" its interval, or the share of solved layouts lies below {HALF} with its interval",
    OPEN: "the interval of the gain begins at or below 0 at one of the budgets",
    FIRST: "the greatest lower end with 50 episodes; those that agree to two digits are ordered by"
    " the lower end with 300, and then by processor time with 50",
    SECOND: "the next one",
    LATER: "all others",
}
EXPECTED_FIRST: Mapping[int, str] = {50: "undone-GN-J", 300: "CMA-ES"}  # greatest lower end
EXPECTED_NEVER = ("DPG",)


def advice(table: pd.DataFrame) -> pd.DataFrame:
    """The advice on each entry by `ADVICE`, the first to try first; a row an entry and part.

    Columns of `rows`, the lower end `low` of the gain, the `word` of the advice, and `tuning`, the
    rollouts that its tuning took.
    """
    judged = (rows(table[table.part == part]) for part in ADVISED)
    found = pd.concat(judged, ignore_index=True)
    found = found[~found.entry.isin([CONTROL, *found.entry[found.disqualified]])]
    low = found.gain.map(lambda one: one.low).astype(float)
    fails = [one.gain.high < 0 or one.solved.high < HALF for one in found.itertuples()]
    rated = found.assign(low=low, gains=low > 0, fails=np.array(fails, bool))
    by_entry = rated.groupby("entry", sort=False)
    entries = by_entry.agg({"fails": "all", "gains": "all", "seconds": "first"})
    for part in ADVISED:
        entries[part] = rated[rated.part == part].set_index("entry").low.round(DIGITS)
    keys = {"fails": True, "gains": False, **dict.fromkeys(ADVISED, False), "seconds": True}
    entries = entries.sort_values([*keys], ascending=[*keys.values()])
    place = entries.gains.cumsum()
    asked = [entries.fails, ~entries.gains, place == 1, place == 2]
    entries["word"] = np.select(asked, [NEVER, OPEN, FIRST, SECOND], LATER)
    spent = table[table.part == "tune"].groupby("entry").episodes.sum()
    entries["tuning"] = spent.reindex(entries.index, fill_value=0)
    words = entries[["word", "tuning"]].reset_index()
    return words.merge(rated.drop(columns=["gains", "fails"]), on="entry")


def greatest(advised: pd.DataFrame) -> dict[int, str]:
    """The entry of `advice` with the greatest lower end, by episodes; see `EXPECTED_FIRST`."""
    ends = advised.dropna(subset="low").set_index("entry").groupby("part", sort=False).low
    return {PARTS[str(part)].episodes: str(entry) for part, entry in ends.idxmax().items()}


def expectations(advised: pd.DataFrame) -> dict[str, bool]:
    """Whether each expectation came true, as far as rows are known."""
    first, words = greatest(advised), dict(zip(advised.entry, advised.word, strict=True))
    return {
        f"{entry} is first with {budget} episodes": first[budget] == entry
        for budget, entry in EXPECTED_FIRST.items()
        if budget in first
    } | {f"{one} is never advised": words[one] == NEVER for one in EXPECTED_NEVER if one in words}


def _paired(table: pd.DataFrame, part: str, *entries: str) -> pd.DataFrame:
    """The shares of entries in the layouts in which all were judged."""
    found = {one: shares(_runs(table, part, one)) for one in entries}
    return pd.DataFrame(found, columns=[*entries]).dropna()


def _costs(table: pd.DataFrame, part: str, entry: str) -> pd.DataFrame:
    """Mean costs by layout."""
    return _runs(table, part, entry).groupby("place", sort=False)[["initial", "cost"]].mean()


def _search_and_learning(table: pd.DataFrame) -> Answer:
    both = _paired(table, "judge 300", "CMA-ES", "ES")
    numbers = {
        f"{entry} in {layout}": float(each)
        for entry in both
        for layout, each in shares(_runs(table, "named 300", str(entry))).items()
    }
    return share(both["CMA-ES"] > both["ES"], numbers=numbers)


def _gains(entry: str, table: pd.DataFrame) -> Answer:
    costs = _costs(table, "judge 50", entry)
    return share(costs.cost < costs.initial)


def _by_hand(table: pd.DataFrame) -> Answer:
    """Asked where the robot arrives with the theta_c of the grid."""
    arrived = table[table.arrived.astype(bool)]
    costs = {"grid": _costs(arrived, "judge 300", "grid").cost,
             "GES": _costs(table, "judge 300", "GES").cost}  # fmt: skip
    both = pd.DataFrame(costs).dropna()
    return share(both["grid"] < both["GES"])


def _guard(table: pd.DataFrame) -> Answer:
    """Asked by layout of the step sizes with which RDES fails: does the guard solve most?"""
    found = {}
    for entry in ("RDES", "guarded-RDES"):
        runs = _runs(table, "tune", entry)
        size = runs.arm.map({arm: i for i, arm in enumerate(arms(entry))})
        found[entry] = suite.solved(runs).set_axis(pd.MultiIndex.from_arrays([runs.place, size]))
    both = pd.DataFrame(found).dropna().astype(bool)
    helps = both["guarded-RDES"][~both["RDES"]].groupby(level=0).mean()
    return share(helps > MAJORITY)


def _difference(first: str, second: str, table: pd.DataFrame) -> Answer:
    """Confirmed if the first has surely more of the gain, contradicted if it has surely less."""
    both = _paired(table, "judge 50", first, second)
    with np.errstate(invalid="ignore"):  # where both failed
        more = both[first] - both[second]
    more = more.mask(both[first] == both[second], 0.0)
    if len(more) < 2:
        return Answer(UNDECIDABLE, {"layouts": (0, len(more))})
    found = gain(more)
    outcome = above(found.low, found.high)
    return Answer(
        outcome,
        numbers={"difference": found.value, "low": found.low, "high": found.high},
        beside={"layouts with more": count(more > 0)},
        said=NO_DIFFERENCE if outcome == PARTLY else "",
    )


QUESTIONS = questions(__file__, {
    "search and learning": _search_and_learning,
    "search nears the best":
        lambda table: share(shares(_runs(table, "judge 300", "CMA-ES")) >= NEARLY),
    "undone steps on the loop's cost gain": partial(_gains, "undone-GN-J"),
    "undone steps on the TD error gain": partial(_gains, "undone-LSTD-Q"),
    "one number by hand": _by_hand,
    "faster auxiliary weights": partial(_difference, "GES-3", "GES"),
    "guard": _guard,
    "lengths or directions": partial(_difference, "guarded-RDES", "control-RDES"),
    "averaging": partial(_difference, "averaged-ES", "ES"),
    "undo": partial(_difference, "undone-ES", "ES"),
})  # fmt: skip

REMEDIES = Investigation(
    name="remedies",
    parts=PARTS,
    questions=QUESTIONS,
    seed=seed_of,
    registered="ebf53a4",
    libraries=("cma", "optuna"),
    digits=7,
    prepare=_compile_ahead,
)
