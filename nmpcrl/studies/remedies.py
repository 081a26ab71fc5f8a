"""21 learners, remedies and searches at equal interaction: what to try where learning fails.

Settings, parts, questions and the rule of the advice were committed before any entry was tuned or
judged; a test compares them with that commit, whose file says what each question measures, where
yes ends, and which pilots were known.

**Interaction.** Every episode counts: with noise, confirming, or of a tuner. An entry has 50 or 300
a layout and seed, and begins from theta_init.

**Tuning.** An entry that has settings tries four, the default first, in the layouts of `tune`. The
best by the measure below is judged with 50 and with 300 episodes.

**Measure.** The share of the possible gain, (J_init - J) / (J_init - J_best), of rollouts without
noise: the interquartile mean over layouts of the mean over seeds, with an interval of 95 % by a
bootstrap over layouts. J_best is the lowest cost in a CMA-ES of `YARDSTICK` rollouts, so that a
share may exceed 1. Layouts where less than `LEAST_GAIN` of J_init can be gained are counted, but
have no share. A failed solve costs infinitely much.

The part `best` searches for J_best, a column of the rows of all other parts; of itself nothing was
published.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis import suite
from nmpcrl.analysis.statistics import Estimate, interquartile_mean, rate
from nmpcrl.analysis.suite import ENTRIES, Entry, judge, seed_of
from nmpcrl.claims.investigation import (
    Answer,
    Condition,
    Investigation,
    Part,
    Question,
    Row,
    above,
    share,
)
from nmpcrl.claims.rule import MAJORITY
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.refusal import Refusal

Setting: TypeAlias = tuple[Entry, Mapping[str, float]]  # an entry, and J_best of each layout

YARDSTICK, YARDSTICK_SEED = 1000, 9_000_000  # rollouts of the search for J_best, its seed
LEAST_GAIN = 0.005  # of J_init; where less is possible, the share would be noise
HALF = 0.5  # of the layouts; an entry that surely solves fewer is never advised
DIGITS = 2  # of the ends of intervals that are compared
NEARLY = 0.9  # of the possible gain, in "search nears the best"
CONTROL = "frozen"  # on which nothing is advised
NO_DIFFERENCE = "no difference shown"  # an interval that holds 0 confirms nothing in part

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
CONTROLS = ("guarded-RDES", "control-RDES")  # of what a guard does
DEAR = ("RDES", "DES", "GN-J", "undone-GN-J", "DPG")  # more than a second a layout at 50


# Parts.


class NotTuned(Refusal):
    """An entry cannot be judged before its tuning, or anything without J_best."""


def arms(entry: str) -> dict[str, Entry]:
    """An entry with each of its settings, the default first."""
    every = (ENTRIES[entry].with_settings(**one) for one in SETTINGS[entry] or ({},))
    return {str(one): one for one in every}


def tuned(table: pd.DataFrame) -> list[Entry]:
    """Every entry with its best setting.

    Raises:
        NotTuned: a row of its tuning is missing.
    """
    known, found = table[table.part == "tune"], []
    for entry, settings in SETTINGS.items():
        every, runs = arms(entry), known[known.entry == entry]
        if len(runs) < len(settings) * len(PARTS["tune"].places):
            raise NotTuned(f"{entry} is not tuned yet: the part 'tune' comes first")
        found.append(every[best_setting(runs) if settings else entry])
    return found


def best_setting(runs: pd.DataFrame) -> str:
    """The arm with the greatest gain, of equal ones the first.

    Args:
        runs: of an entry in the part `tune`.
    """
    values = {str(arm): gain(shares(each)).value for arm, each in runs.groupby("arm", sort=False)}
    return max(values, key=lambda arm: values[arm])


def run(setting: Setting, place: str, episodes: int, seed: int) -> Row:
    """The judgement of an entry in a layout."""
    entry, best = setting
    found = asdict(judge(entry, place, seed, episodes))
    del found["inside"]  # no obstacle moves
    return {"entry": entry.name, "best": best.get(place, found["cost"]), **found}


def _search(setting: Setting, place: str, episodes: int, _: int) -> Row:
    """The search for J_best, with the same seed in each layout."""
    return run(setting, place, episodes, YARDSTICK_SEED)


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
                raise NotTuned(f"J_best of {place} is not known yet: the part 'best' comes first")
        costs = {place: float(best[place]) for place in places}
        return {str(one): (one, costs) for one in entries(table)}

    fewer = {arm: count for entry, count in (first or {}).items() for arm in arms(entry)}
    return Part(run, settings, places, episodes, seeds, first=fewer, seconds=SECONDS)


def _settings(_: pd.DataFrame) -> list[Entry]:
    """Every entry with each of its settings."""
    return [one for entry in SETTINGS if SETTINGS[entry] for one in arms(entry).values()]


_TUNED, _JUDGED, _NAMED = tuple(TUNE)[:15], tuple(JUDGE), tuple("ABCDEF")
_NONE = dict.fromkeys(CONTROLS, 0)
_SEARCH = {"CMA-ES": (ENTRIES["CMA-ES"], dict[str, float]())}
PARTS: Mapping[str, Part] = {
    "best": Part(_search, _SEARCH, (*_TUNED, *_JUDGED, *_NAMED), YARDSTICK, seconds=SECONDS),
    "tune": _part(_settings, _TUNED, 50),
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


# The measure.


@dataclass(frozen=True)
class RemedyRow:
    """The result of an entry in one part."""

    part: str
    entry: str
    name: str  # with its settings
    gain: Estimate  # share of the possible one: interquartile mean over layouts
    solved: Estimate  # share of the layouts
    layouts: int
    left_out: int  # layouts without a share, since hardly any gain is possible there
    rollouts: int  # of a layout and seed at most, confirming ones and a tuner's included
    seconds: float  # of processor time, mean of a layout and seed
    disqualified: bool  # whether it began too many somewhere


def shares(runs: pd.DataFrame) -> pd.Series:
    """The share of the possible gain by layout, the mean over its seeds; -inf where one failed.

    Args:
        runs: of one arm in one part.
    """
    possible = runs.initial - runs.best
    there = runs[possible >= LEAST_GAIN * runs.initial]
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


def rows(table: pd.DataFrame, part: str) -> tuple[RemedyRow, ...]:
    """One row an entry, in the order of `SETTINGS`."""
    each = ((entry, _runs(table, part, entry)) for entry in SETTINGS)
    return tuple(row(part, entry, runs) for entry, runs in each if len(runs))


def row(part: str, entry: str, runs: pd.DataFrame) -> RemedyRow:
    """The row of one entry, of its runs in a part."""
    gained, well = shares(runs), solved(runs)
    return RemedyRow(
        part=part,
        entry=entry,
        name=str(runs.arm.iloc[0]),
        gain=gain(gained),
        solved=rate(int(well.sum()), len(well)),
        layouts=len(well),
        left_out=len(well) - len(gained),
        rollouts=int(runs.episodes.max()),
        seconds=float(runs.seconds.mean()),
        disqualified=bool(runs.over.any()),
    )


def _runs(table: pd.DataFrame, part: str, entry: str) -> pd.DataFrame:
    return table[(table.part == part) & (table.entry == entry)]


# Advice.

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
_RANK = (LATER, OPEN, NEVER)  # before first and second are chosen


@dataclass(frozen=True)
class Advice:
    """Whether to try an entry, and why."""

    entry: str
    word: str  # of `ADVICE`
    rows: Mapping[str, RemedyRow] = field(default_factory=dict)  # by part
    tuning: int = 0  # rollouts that were spent to find its setting


def advice(table: pd.DataFrame) -> tuple[Advice, ...]:
    """The advice on each entry by `ADVICE`, the first to try first."""
    judged = [row for part in ADVISED for row in rows(table, part)]
    refused = {CONTROL, *(row.entry for row in judged if row.disqualified)}
    found: dict[str, dict[str, RemedyRow]] = {}
    for row in judged:
        if row.entry not in refused:
            found.setdefault(row.entry, {})[row.part] = row
    words = {entry: _word(list(by_part.values())) for entry, by_part in found.items()}
    order = sorted(found, key=lambda entry: (_RANK.index(words[entry]), _order(found[entry])))
    gaining = [entry for entry in order if words[entry] == LATER]
    words |= dict(zip(gaining, (FIRST, SECOND), strict=False))
    spent = table[table.part == "tune"].groupby("entry").episodes.sum()
    return tuple(
        Advice(entry, words[entry], found[entry], int(spent.get(entry, 0))) for entry in order
    )


def _word(judged: list[RemedyRow]) -> str:
    """The advice before first and second are chosen."""
    if all(one.gain.high < 0 or one.solved.high < HALF for one in judged):
        return NEVER
    return LATER if all(one.gain.low > 0 for one in judged) else OPEN


def _order(judged: Mapping[str, RemedyRow]) -> tuple[float, ...]:
    """The key by which entries are sorted: rounded lower ends by budget, then time."""
    ends = [-round(judged[part].gain.low, DIGITS) if part in judged else np.inf for part in ADVISED]
    known = next(iter(judged.values()))
    return (*(np.inf if np.isnan(one) else one for one in ends), known.seconds)


def greatest(table: pd.DataFrame) -> dict[int, str]:
    """The entry whose gain has the greatest lower end, by episodes; see `EXPECTED_FIRST`."""
    found = {}
    for part in ADVISED:
        known = [one for one in rows(table, part) if not np.isnan(one.gain.low)]
        if known:
            found[PARTS[part].episodes] = max(known, key=lambda one: one.gain.low).entry
    return found


def expectations(table: pd.DataFrame) -> dict[str, bool]:
    """Whether each expectation came true, as far as rows are known."""
    first = greatest(table)
    said = {
        f"{entry} is first with {budget} episodes": first[budget] == entry
        for budget, entry in EXPECTED_FIRST.items()
        if budget in first
    }
    words = {one.entry: one.word for one in advice(table)}
    known = words.keys() & {*EXPECTED_NEVER}
    return said | {f"{one} is never advised": words[one] == NEVER for one in sorted(known)}


# Questions.


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


def _nears(table: pd.DataFrame) -> Answer:
    return share(shares(_runs(table, "judge 300", "CMA-ES")) >= NEARLY)


def _gains(entry: str) -> Callable[[pd.DataFrame], Answer]:
    def answer(table: pd.DataFrame) -> Answer:
        costs = _costs(table, "judge 50", entry)
        return share(costs.cost < costs.initial)

    return answer


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


def _difference(first: str, second: str) -> Callable[[pd.DataFrame], Answer]:
    """Confirmed if the first has surely more of the gain, contradicted if it has surely less."""

    def answer(table: pd.DataFrame) -> Answer:
        both = _paired(table, "judge 50", first, second)
        with np.errstate(invalid="ignore"):  # where both failed
            more = both[first] - both[second]
        more = more.mask(both[first] == both[second], 0.0)
        if len(more) < 2:
            return Answer(UNDECIDABLE, {"layouts": (0, len(more))})
        found = gain(more)
        outcome = above(found.low, found.high)
        numbers = {"difference": found.value, "low": found.low, "high": found.high}
        beside = {"layouts with more": (int((more > 0).sum()), len(more))}
        said = NO_DIFFERENCE if outcome == PARTLY else ""
        return Answer(outcome, numbers=numbers, beside=beside, said=said)

    return answer


_SEARCH_BEFORE = (
    "CMA-ES with 300 rollouts has 0.98, 1.0, 0.99, 0.99, 0.71 and 0.38 of the possible gain in"
)
QUESTIONS = (
    Question("search and learning",
             "Has CMA-ES more of the possible gain than ES with 300 episodes each?",
             REPRODUCED, _search_and_learning,
             f"{_SEARCH_BEFORE} A to F, where ES has 0.53, 0.47, 0.72 and 0.45 and fails."),
    Question("search nears the best",
             "Has CMA-ES at least 0.9 of the possible gain with 300 rollouts?",
             PARTLY, _nears, f"{_SEARCH_BEFORE} A to F."),
    *(
        Question(f"undone steps on the {what} gain", f"Does {entry} gain?", REPRODUCED,
                 _gains(entry), "Gauss-Newton with undo gained in 18 of 18.")
        for what, entry in (("loop's cost", "undone-GN-J"), ("TD error", "undone-LSTD-Q"))
    ),
    Question("one number by hand",
             "Does the grid over theta_c cost less than GES with 300 episodes?",
             REPRODUCED, _by_hand,
             "theta_c by hand does better than GES wherever the robot still arrives."),
    Question("faster auxiliary weights",
             "Has GES with beta = 3 alpha and a normalised step more of the gain than GES?",
             PARTLY, _difference("GES-3", "GES")),
    Question("guard",
             "Does RDES with the guard solve the layout where RDES with that step size does not?",
             REPRODUCED, _guard, "The guard stops the overshoot."),
    Question("lengths or directions",
             "Has RDES with the guard more of the gain than its lengths in ES's direction?",
             NOT, _difference("guarded-RDES", "control-RDES")),
    Question("averaging",
             "Has the averaged theta of ES more of the gain than its last theta?",
             NOT, _difference("averaged-ES", "ES")),
    Question("undo",
             "Has ES with undo more of the gain than ES with as much interaction?",
             PARTLY, _difference("undone-ES", "ES")),
)  # fmt: skip

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
