"""The runs in 180 drawn layouts: in how many each claim holds, and ten questions.

Parts, expected shares, thresholds and questions were committed before any run; a test compares them
with that commit, whose file also says what each question measures and where yes ends. The question
"extrapolation" is answered by `interventions`.

A layout is the unit. Each has noise of its own: two seeds that no other layout has. A claim has
several answers in a layout, one or two in each reading of the decay; it holds there if more than
`MAJORITY` of them are yes. Shares of layouts are read by `rule.read`. Rows that are missing are
left out: a layout answers what its runs can tell.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis import trap
from nmpcrl.analysis.rows import OUTCOME, as_text, cost_ratios, row
from nmpcrl.analysis.statistics import rate
from nmpcrl.analysis.summaries import SUMMARIES
from nmpcrl.claims import published as six
from nmpcrl.claims.by_runs import RunClaim
from nmpcrl.claims.investigation import (
    NAMES,
    Answer,
    Condition,
    Investigation,
    Part,
    Question,
    Row,
    above,
    counted,
    share,
)
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS, WIDER_CLAIMS
from nmpcrl.claims.robustness import groups
from nmpcrl.claims.rule import MAJORITY, Observations, Paths, forgiving, read
from nmpcrl.claims.thresholds import improves, was_stopped
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome
from nmpcrl.studies.difficulty import DIFFICULTY, HORIZONS, MEASURES, OPEN, PILOT, RIVALS, STOPS
from nmpcrl.studies.difficulty import SAME_CLOSING as SAME_CLOSING
from nmpcrl.studies.predictors import predictor_scores
from nmpcrl.study import paper, published
from nmpcrl.study.design import MAIN_TABLE
from nmpcrl.study.drawn import COMPARED, JUDGE, LAYOUTS, TUNE, name_of
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.files import Column
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.learners import DECAYS
from nmpcrl.study.setup import compile_ahead

CLOSES_BEFORE = 0.2  # theta_c; the pilot: below it the first gap of the first trajectory closes
STANDING = 0.05  # [m]; a robot stands if it moves less in the last `STOOD` steps of a rollout
STOOD = trap.STOOD
CLIFF_RAISED = 0.02  # share by which the best theta_c is raised, beside the cliff
CLIFF_COST = 0.5  # share of the best cost that this adds
DEAD_BY = 20  # episodes: a run that was stopped by then overshot early

SEEDS = 2  # of each layout
STEP_SIZE = 3  # times alpha, in the search for the paper's whole picture
LARGER = f"alpha x {STEP_SIZE}"
SOLVING = ("frozen", "ES", "GES", "TDC")
IMITATING = ("RDES", "DES")
SOLVING_TWICE = ("frozen", "ES", "GES")  # for predictors and horizons: the cheap ones
JUDGED = ("judge", "judge imitating", "judge again")  # parts
PICTURE = ("C1", "C2", "C5", "C9")  # the paper's whole picture
FOLLOWED = ("RDES", "GES")  # whose paths C5 compares
MILLIMETRES = 1000
NOWHERE = np.iinfo(np.int16).min  # a position after a failed solve


@dataclass(frozen=True)
class Share:
    """The share of the layouts in which a claim is expected to hold."""

    low: float
    high: float
    outcome: Outcome  # by `rule.read`

    def __contains__(self, share: float) -> bool:
        return self.low <= share <= self.high


# C9, the claim on a learner's cost, is also asked of each learner alone; "C9" joins RDES and GES.
EXPECTED: Mapping[str, Share] = {
    "C1": Share(0.05, 0.35, PARTLY),
    "C2": Share(0.0, 0.05, NOT),
    "C5": Share(0.25, 0.7, PARTLY),
    "C6": Share(0.9, 1.0, REPRODUCED),
    "C7": Share(0.0, 0.1, NOT),
    "C9": Share(0.75, 0.95, PARTLY),
    "W7": Share(0.0, 0.1, NOT),
    "W9": Share(0.7, 0.95, PARTLY),
    "B1": Share(0.1, 0.5, PARTLY),
    "ES improves": Share(0.85, 0.97, REPRODUCED),
    "GES improves": Share(0.85, 0.97, REPRODUCED),
    "TDC improves": Share(0.85, 1.0, REPRODUCED),
    "RDES improves": Share(0.7, 0.95, PARTLY),
    "DES improves": Share(0.3, 0.8, PARTLY),
}


# The runs.


def arms(learners: Iterable[str], decays: Iterable[str] = DECAYS, **fields: Any) -> dict[str, Any]:
    """Each learner in each reading of the decay: "ES step"."""
    return {
        f"{learner} {decay}": Experiment(learner=learner, decay=decay, **fields).canonical
        for learner, decay in product(learners, decays)
    }


def of_run(setting: Experiment, place: str, episodes: int, seed: int) -> Row:
    """The row of a run, which is trained unless its summary is stored."""
    experiment = replace(setting, layout=LAYOUTS[place], episodes=episodes, seed=seed)
    summary = SUMMARIES.fetch(experiment)
    known = row(summary) | (ending := trap.ending(summary))
    found = {name: known[name] for name in (*OUTCOME, *ending)}
    if experiment.learner in FOLLOWED:
        found["positions"] = in_millimetres(summary.states[:, :2])
    return found


def in_millimetres(positions: Column) -> list[list[int]]:
    """Positions of a rollout in whole millimetres."""
    where = np.where(np.isfinite(positions), np.round(positions * MILLIMETRES), NOWHERE)
    found: list[list[int]] = where.astype(int).tolist()
    return found


def in_metres(positions: Any) -> Column:
    """Positions of `in_millimetres` [m]; nan after a failed solve."""
    where = np.array(positions, np.int16)
    result: Column = np.where(where == NOWHERE, np.nan, where / MILLIMETRES)
    return result


def seed_of(place: str, k: int) -> int:
    """The k-th seed of a layout; no two layouts have a seed in common."""
    return SEEDS * [*LAYOUTS].index(place) + k


def _part(arms: Mapping[str, Any], places: Iterable[str], begin: int = 0) -> Part:
    return Part(of_run, arms, tuple(places), paper.EPISODES, begin=begin)


def _compile_ahead(missing: Iterable[tuple[Condition, Any]]) -> None:
    compile_ahead([replace(it, layout=LAYOUTS[one.place]) for one, it in missing])


PARTS = {
    "judge": _part(arms(SOLVING), JUDGE),
    "tune": _part(arms(SOLVING_TWICE), TUNE),
    **{f"N = {n}": _part(arms(SOLVING_TWICE, horizon=n), COMPARED) for n in HORIZONS},
    "judge imitating": _part(arms(IMITATING), JUDGE),
    LARGER: _part(arms(PAPER, ["step"], alpha=STEP_SIZE * paper.ALPHA), COMPARED),
    "judge again": _part(arms((*SOLVING, *IMITATING)), JUDGE, begin=1),
}


# What questions are asked of.


def experiments(table: pd.DataFrame) -> list[Experiment]:
    """The experiment of each row."""
    return [
        replace(_setting(one), layout=LAYOUTS[one.place], seed=seed_of(one.place, one.k))
        for one in _conditions(table)
    ]


def _conditions(table: pd.DataFrame) -> list[Condition]:
    return [Condition(*one) for one in table[NAMES].itertuples(index=False, name=None)]


def _setting(one: Condition) -> Experiment:
    found: Experiment = PARTS[one.part].settings(pd.DataFrame())[one.arm]
    return found


@dataclass(frozen=True, eq=False)
class Drawn:
    """Runs, paths and measures of layouts, of which claims and questions are asked."""

    runs: pd.DataFrame  # of `rows.table`, with `part` and the columns of `trap`
    paths: Paths  # positions alone, shape (K + 1, 2)
    layouts: pd.DataFrame  # columns of `difficulty`, a row a layout

    @property
    def main(self) -> pd.DataFrame:
        """The runs by which claims are judged."""
        return self.runs[self.runs.part.isin(JUDGED)]

    @property
    def stops(self) -> pd.DataFrame:
        """The theta_c from which rollouts in compared layouts do not arrive, a column a horizon."""
        return self.layouts.loc[[*COMPARED], [*STOPS.values()]].set_axis([*STOPS], axis=1)

    @cached_property
    def shares(self) -> pd.DataFrame:
        """The shares of layouts in which claims hold, as `shares` gives them."""
        return shares(held(self.main, self.paths))

    @cached_property
    def tried(self) -> pd.DataFrame:
        """The cells of `everywhere`, with the published runs in layouts A to F."""
        named = six.load()
        return everywhere(self.runs, self.paths, named.table, named.paths)


def of_table(table: pd.DataFrame) -> Drawn:
    """The runs of a table, with the published measures of the layouts."""
    made = experiments(table)
    known = table.drop(columns=["arm", "place", "k", "positions"], errors="ignore")
    rows = {
        e: {name: as_text(value) for name, value in asdict(e).items()} | one
        for e, one in zip(made, known.to_dict("records"), strict=True)
    }
    ratios = cost_ratios(rows)
    runs = pd.DataFrame([one | {"cost_ratio": ratios[e]} for e, one in rows.items()])
    followed = zip(made, _positions(table), strict=True)
    paths = {e: in_metres(one) for e, one in followed if e.learner in FOLLOWED}
    layouts = DIFFICULTY.table().set_index("place").rename_axis("layout")
    columns = [*MEASURES, *STOPS.values()]
    return Drawn(runs, paths, layouts[columns])


def _positions(table: pd.DataFrame) -> list[Any]:
    """The positions of each row: made here or published."""
    if "positions" in table:
        return [*table.positions]
    rows = (one for one in _conditions(POPULATION.table()) if _setting(one).learner in FOLLOWED)
    known = dict(zip(rows, published.arrays("population")["positions"], strict=True))
    return [known.get(one) for one in _conditions(table)]


def load() -> Drawn:
    """The published runs.

    Raises:
        Damaged: they are missing, or are not those that were written.
    """
    return _load(published.folder())


@cache
def _load(_: Path) -> Drawn:
    return of_table(POPULATION.table())


# Claims.


def asked() -> dict[str, RunClaim]:
    """The claims that are judged in each layout, by their names in `EXPECTED`."""
    known = {**BY_RUNS, **WIDER_CLAIMS, **OWN_CLAIMS}
    alone = {name: name.partition(" ")[0] for name in EXPECTED if name not in known}
    by_itself = {
        name: replace(BY_RUNS["C9"], name=name, learners=(learner,))
        for name, learner in alone.items()
    }
    return {name: (known | by_itself)[name] for name in EXPECTED}


def held(
    runs: pd.DataFrame,
    paths: Paths,
    claims: Iterable[str] = tuple(EXPECTED),
    called: Callable[[Any], str] = name_of,
) -> pd.DataFrame:
    """Where each claim holds, a row a claim and layout with its answers.

    Args:
        runs: of `rows.table`, of one setting.
        paths: as `rule.Observations` takes them.
        claims: names in `EXPECTED`.
        called: the name of a layout, by default of a drawn one; `str` for A to F.

    Returns:
        Columns claim, layout (its name), yes, of (answers), holds and weaker (whether the weaker
        question holds there, if the claim has one; else as holds).
    """
    rows, known, there = [], asked(), {*runs.learner}
    for name in claims:
        if not {*known[name].learners} <= there:
            continue
        strict, weaker = (
            one.dropna().astype(bool).groupby(level="layout", sort=False)
            for one in known[name].asked(Observations(runs, paths))
        )
        counts = strict.agg(["sum", "size"]).join(weaker.mean().rename("weaker"))
        for layout, (yes, of, mild) in counts.iterrows():
            held_there = (yes / of > MAJORITY, mild > MAJORITY)
            rows.append((name, called(layout), int(yes), int(of), *held_there))
    return pd.DataFrame(rows, columns=["claim", "layout", "yes", "of", "holds", "weaker"])


def shares(where: pd.DataFrame) -> pd.DataFrame:
    """The share of the layouts in which each claim holds, beside the expected share.

    Args:
        where: of `held`.

    Returns:
        Columns claim, holding, layouts, share, low, high (by `rate`: layouts are independent),
        outcome (by the rule, weaker questions included), weaker (layouts in which the weaker
        question holds), expected (an outcome) and within (the share that was expected).
    """
    rows = []
    for name, group in where.groupby("claim", sort=False):
        holding, layouts = int(group.holds.sum()), len(group)
        found, expected = rate(holding, layouts), EXPECTED[str(name)]
        numbers = (found.value, found.low, found.high)
        weaker = int(group.weaker.sum())
        outcome = forgiving(read(holding, layouts), read(weaker, layouts))
        said = (outcome, weaker, expected.outcome, found.value in expected)
        rows.append((name, holding, layouts, *numbers, *said))
    names = ["claim", "holding", "layouts", "share", "low", "high"]
    return pd.DataFrame(rows, columns=[*names, "outcome", "weaker", "expected", "within"])


def succeeds(runs: pd.DataFrame, learner: str = "ES") -> pd.Series:
    """Whether a learner improves in each layout, by its name."""
    where = held(runs, {}, [f"{learner} improves"])
    return where.set_index("layout").holds.astype(bool)


def _holding(claim: str) -> Callable[[Drawn], Answer]:
    def answer(drawn: Drawn) -> Answer:
        found = drawn.shares.set_index("claim")
        if claim not in found.index:
            return Answer(UNDECIDABLE)
        one = found.loc[claim]
        return Answer(one.outcome, {"layouts": (int(one.holding), int(one.layouts))})

    return answer


# The whole picture. A cell is a layout and a reading of the decay in a setting.


def picture(runs: pd.DataFrame, paths: Paths, setting: str) -> pd.DataFrame:
    """The part of the paper's picture that holds in each layout and reading.

    Args:
        runs: of one setting, with all four of the paper's learners.
        paths: as `rule.Observations` takes them.
        setting: its name.

    Returns:
        Columns layout and decay, of each of `PICTURE` the share of yes, whole (how many claims have
        nothing but yes), answers (the mean share) and setting; cells with all four answers.
    """
    known, columns = asked(), {}
    for name in PICTURE:
        claim = known[name]
        answers = claim.yes(claim.measure(runs, paths), claim.threshold).dropna().astype(float)
        columns[name] = answers.groupby(level=["layout", "decay"]).mean()
    found = pd.DataFrame(columns).dropna()
    found["whole"] = (found[[*PICTURE]] == 1).sum(axis=1)
    found["answers"] = found[[*PICTURE]].mean(axis=1)
    return found.reset_index().assign(setting=setting)


def everywhere(
    drawn: pd.DataFrame, drawn_paths: Paths, named: pd.DataFrame, named_paths: Paths
) -> pd.DataFrame:
    """The cells of `picture` in drawn layouts and in A to F, the nearest to the picture first.

    A learner that a variant does not change has its runs of the main table in it.
    """
    settings = {MAIN_TABLE: drawn[drawn.part.isin(JUDGED)], LARGER: drawn[drawn.part == LARGER]}
    found = [picture(runs, drawn_paths, one) for one, runs in settings.items() if len(runs)]
    found.append(picture(named[named.variant == MAIN_TABLE], named_paths, MAIN_TABLE))
    varied = named.variant[named.learner.isin(PAPER) & (named.variant != MAIN_TABLE)].unique()
    found += [picture(groups(named, name)[0], named_paths, str(name)) for name in varied]
    return pd.concat(found).sort_values(
        ["whole", "answers"], ascending=False, kind="stable", ignore_index=True
    )


def whole_picture(tried: pd.DataFrame) -> Answer:
    """The answer of the cells of `everywhere`."""
    if tried.empty:
        return Answer(UNDECIDABLE)
    found = int((tried.whole == len(PICTURE)).sum())
    numbers = {"tried": float(len(tried)), "most": float(tried.whole.max())}
    beside, said = {"settings": (found, len(tried))}, "found by search" if found else ""
    return Answer(REPRODUCED if found else NOT, numbers=numbers, beside=beside, said=said)


# Other questions.


def closing_gaps(layouts: pd.DataFrame, judged: pd.Series) -> Answer:
    """The answer of the measures of layouts, and of whether ES improves in each."""
    closes = layouts.loc[judged.index, PILOT] < CLOSES_BEFORE
    counts = {
        "layouts fail where it closes": counted(~judged[closes]),
        "layouts succeed elsewhere": counted(judged[~closes]),
    }
    outcomes = {read(*count) for count in counts.values()}
    worst = [one for one in (NOT, UNDECIDABLE) if one in outcomes]
    both = REPRODUCED if outcomes == {REPRODUCED} else PARTLY
    return Answer(worst[0] if worst else both, counts)


def predictors(scores: pd.DataFrame) -> Answer:
    """The answer of `predictor_scores`."""
    ahead = [scores.ahead[name] for name in RIVALS]
    lows, highs = [one.low for one in ahead], [one.high for one in ahead]
    outcome = above(min(lows), min(highs)) if np.isfinite(lows).all() else UNDECIDABLE
    numbers = {name: one.value for name, one in zip(RIVALS, ahead, strict=True)}
    beside = {"other measures surely behind": (sum(low > 0 for low in lows), len(lows))}
    return Answer(outcome, numbers=numbers, beside=beside)


def _predictors(drawn: Drawn) -> Answer:
    tuned, judged = succeeds(drawn.runs[drawn.runs.part == "tune"]), succeeds(drawn.main)
    if tuned.empty or judged.empty:
        return Answer(UNDECIDABLE)
    return predictors(predictor_scores(drawn.layouts, tuned, judged))


def horizon(runs: pd.DataFrame) -> Answer:
    """The answer of the runs of all parts: the first seeds, with each horizon."""
    longer = {n: runs[runs.part == f"N = {n}"] for n in HORIZONS}
    first = {*pd.concat(longer.values()).seed}
    base = succeeds(runs[(runs.part == "judge") & runs.seed.isin(first)])
    ends = [succeeds(one) for one in longer.values()]
    asked_of = [name for name in base.index[~base] if all(name in one.index for one in ends)]
    yes = pd.Series([not any(one[name] for one in ends) for name in asked_of], dtype=bool)
    return share(yes, "layouts still fail")


def gaps_and_horizon(stops: pd.DataFrame) -> Answer:
    """The answer of `Drawn.stops`; nan where a rollout arrives on the whole grid."""
    known = stops[stops[paper.HORIZON].notna()]
    apart = known.max(axis=1, skipna=False) - known.min(axis=1, skipna=False)
    return share(apart <= SAME_CLOSING + 1e-9, "layouts the same")


def _stands(away: pd.DataFrame) -> pd.Series:
    return (away.moved < STANDING) & (away.worth < 1)


def _gets_worse(away: pd.DataFrame) -> pd.Series:
    return (away.delta_last < away.delta_first) & (away.final_cost > away.initial_cost)


def caught(runs: pd.DataFrame, yes: Callable[[pd.DataFrame], pd.Series]) -> Answer:
    """The share of layouts in which all runs of ES that do not arrive say yes."""
    away = runs[(runs.learner == "ES") & (runs.distance > ARRIVED)]
    answers = yes(away)
    count = counted(answers.groupby(away.layout).all())
    return Answer(read(*count), {"layouts": count, "runs": counted(answers)})


def at_the_gap(runs: pd.DataFrame, layouts: pd.DataFrame) -> pd.DataFrame:
    """The end of each run of ES, and the first gap of its layout; no registered question.

    `closed` is known when training has ended: a split by it depends on the outcome.

    Args:
        runs: of `rows.table`.
        layouts: columns `MEASURES`, a row a layout.

    Returns:
        Columns improves (as `thresholds.improves`), away (from the target, at the end), closes
        (theta_c at which the gap does, `difficulty.OPEN` where there is none), gap (whether there
        is one) and closed (whether theta_c ended above the value at which it closes).
    """
    es = runs[runs.learner == "ES"].reset_index(drop=True)
    closes = layouts[PILOT][es.layout.map(name_of)].to_numpy()
    gap = closes < OPEN
    found = {"improves": improves(es), "away": es.distance > ARRIVED, "closes": closes, "gap": gap}
    return pd.DataFrame(found | {"closed": gap & (es.theta_8 > closes)})


def improve_by_gap(ends: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """Runs that improve, and all runs, in layouts with a gap, by whether it ended open or closed.

    Args:
        ends: of `at_the_gap`.
    """
    there = ends[ends.gap]
    ways = {"open": ~there.closed, "closed": there.closed}
    return {way: counted(there.improves[some]) for way, some in ways.items()}


def early_overshoot(runs: pd.DataFrame) -> Answer:
    """The answer of RDES's stopped runs in the reading per episode."""
    rdes = runs.query("learner == 'RDES' and decay == 'episode'")
    stopped = rdes[was_stopped(rdes)]
    early = stopped.steps_done < DEAD_BY * stopped.steps
    answers = {"layouts overshot": stopped.over > 0, "layouts early": early}
    counts = {
        name: counted(yes.groupby(stopped.layout).mean() > MAJORITY)
        for name, yes in answers.items()
    }
    beside = {"runs stopped": (len(stopped), len(rdes))}
    if not len(stopped):
        return Answer(UNDECIDABLE, counts, beside=beside)
    rates = [rate(*count) for count in counts.values()]
    ends = min(one.low for one in rates), min(one.high for one in rates)
    return Answer(above(*ends, MAJORITY), counts, beside=beside)


def raised() -> pd.Series:
    """The share by which the cost of the best theta rises with theta_c, by layout from A to F."""
    best = {search.layout: np.array(one.theta) for search, one in six.load().searches.items()}
    each = {name: trap.raised_cost(name, best[name], CLIFF_RAISED) for name in sorted(best)}
    return pd.Series(each, dtype=float)


def cliff(raised: pd.Series) -> Answer:
    """The answer of `raised`."""
    return share(raised >= CLIFF_COST, numbers={"most": float(raised.max())})


QUESTIONS: Sequence[Question] = (
    Question("closing gaps",
             "Does ES fail where the gap closes by then, and succeed where it does not?",
             PARTLY, lambda drawn: closing_gaps(drawn.layouts, succeeds(drawn.main)),
             "ES fails exactly where the first gap of the first trajectory closes at theta_c below"
             f" {CLOSES_BEFORE}."),
    Question("predictors",
             "Does the closing of the first gap tell better than each rival where ES succeeds?",
             PARTLY, _predictors),
    Question("horizon",
             "Does ES still fail with N = 20 and N = 40 where it fails with N = 10?",
             REPRODUCED, lambda drawn: horizon(drawn.runs),
             "The horizon was not too short."),
    Question("gaps and horizon",
             "With theta_c raised and nothing learned, does the robot stop arriving at the same"
             " theta_c for N = 10, 20 and 40?",
             REPRODUCED, lambda drawn: gaps_and_horizon(drawn.stops),
             "A gap closes at the same theta_c whatever the horizon."),
    Question("trap",
             "Is that so where ES ends without having arrived?",
             REPRODUCED, lambda drawn: caught(drawn.main, _stands),
             "The robot stands, and the plan's value is below l / (1 - gamma): so delta > 0 and"
             " theta_c grows."),
    Question("accurate and worse",
             "Does |delta| fall while the noise-free cost rises?",
             REPRODUCED, lambda drawn: caught(drawn.main, _gets_worse),
             "In the trap the value gets more accurate while the policy gets worse."),
    Question("cliff",
             f"Does theta_c raised by {CLIFF_RAISED:.0%} cost at least {CLIFF_COST:.0%}?",
             PARTLY, lambda drawn: cliff(raised()),
             "Beside the best theta, 1 to 2 % more theta_c costs 50 to 140 %."),
    Question("early overshoot",
             "Is that so of RDES in the reading per episode with ES's alpha, and of no other?",
             REPRODUCED, lambda drawn: early_overshoot(drawn.main),
             "RDES overshoots early: most of its runs that are stopped have alpha ||phi||^2 > 2,"
             f" and most are dead by episode {DEAD_BY}."),
    Question("whole picture",
             "Is there a layout, reading and step size in which C1, C2, C5 and C9 hold together?",
             NOT, lambda drawn: whole_picture(drawn.tried)),
)  # fmt: skip

POPULATION = Investigation(
    name="population",
    parts=PARTS,
    questions=(
        *(
            Question(name, f"In how many layouts does {name} hold?", one.outcome, _holding(name))
            for name, one in EXPECTED.items()
        ),
        *QUESTIONS,
    ),
    seed=seed_of,
    registered="46c248b",
    digits=6,
    arrays=("positions",),
    evidence=of_table,
    prepare=_compile_ahead,
)
