"""The runs in 180 drawn layouts: in how many each claim holds, and ten questions.

Parts, expected shares, thresholds and questions, in `population.toml`, were committed before any
run; a test compares them with that commit, whose file also has the measure of each question and
its border. The question "extrapolation" is answered by `interventions`.

The unit is a layout. A claim has several answers in a layout, one or two in each reading of the
decay; it holds there if more than `MAJORITY` of them are yes. Shares of layouts are read by
`rule.read`. A layout answers by the runs that are known.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, astuple, dataclass, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis import trap
from nmpcrl.analysis.rows import OUTCOME, as_text, cost_ratios, row
from nmpcrl.analysis.statistics import count, rate
from nmpcrl.analysis.summaries import SUMMARIES
from nmpcrl.claims import published as six
from nmpcrl.claims.by_runs import RunClaim
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS, WIDER_CLAIMS
from nmpcrl.claims.robustness import groups
from nmpcrl.claims.rule import MAJORITY, Observations, Paths, forgiving, read
from nmpcrl.claims.thresholds import was_stopped
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome
from nmpcrl.studies import difficulty
from nmpcrl.studies.difficulty import predictor_scores
from nmpcrl.studies.investigation import (
    NAMES,
    Answer,
    Investigation,
    Part,
    Question,
    Row,
    above,
    questions,
    share,
)
from nmpcrl.study import paper, published
from nmpcrl.study.design import MAIN_TABLE, sweep
from nmpcrl.study.drawn import COMPARED, JUDGE, LAYOUTS, TUNE, name_of
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.learners import DECAYS
from nmpcrl.study.setup import compile_ahead

CLOSES_BEFORE = 0.2  # theta_c; the pilot: below it the first gap of the first trajectory closes
STANDING = 0.05  # [m]; a robot stands if it moves less in the last `STOOD` steps of a rollout
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
IMPROVES = {f"{one} improves": one for one in (*SOLVING, *IMITATING)}  # C9 of one learner
_ASKED: Mapping[str, RunClaim] = {**BY_RUNS, **WIDER_CLAIMS, **OWN_CLAIMS}
CLAIMS: Mapping[str, RunClaim] = {  # judged in each layout, by their names in `EXPECTED`
    name: _ASKED.get(name) or replace(BY_RUNS["C9"], name=name, learners=(IMPROVES[name],))
    for name in EXPECTED
}


def arms(learners: Iterable[str], decays: Iterable[str] = DECAYS, **fields: Any) -> dict[str, Any]:
    """Each learner for each decay of the noise: "ES step"."""
    runs = sweep(learner=tuple(learners), decay=tuple(decays), **fields)
    return {f"{one.learner} {one.decay}": one.canonical for one in runs}


def of_run(setting: Experiment, place: str, episodes: int, seed: int) -> Row:
    """The row of a run, which is trained unless its summary is stored.

    The positions of its last rollout, which C5 compares, are in whole millimetres.
    """
    experiment = replace(setting, layout=LAYOUTS[place], episodes=episodes, seed=seed)
    summary = SUMMARIES.fetch(experiment)
    known = row(summary)
    found: Row = {name: known[name] for name in OUTCOME} | trap.ending(summary)
    if experiment.learner in FOLLOWED:
        where = np.round(summary.states[:, :2] * MILLIMETRES)
        found["positions"] = np.where(np.isfinite(where), where, NOWHERE).astype(int).tolist()
    return found


def seed_of(place: str, k: int) -> int:
    """The k-th seed of a layout; no two layouts have a seed in common."""
    return SEEDS * [*LAYOUTS].index(place) + k


def _part(arms: Mapping[str, Any], places: Iterable[str], begin: int = 0) -> Part:
    return Part(of_run, arms, tuple(places), paper.EPISODES, begin=begin)


PARTS = {
    "judge": _part(arms(SOLVING), JUDGE),
    "tune": _part(arms(SOLVING_TWICE), TUNE),
    **{f"N = {n}": _part(arms(SOLVING_TWICE, horizon=n), COMPARED) for n in difficulty.HORIZONS},
    "judge imitating": _part(arms(IMITATING), JUDGE),
    LARGER: _part(arms(PAPER, ["step"], alpha=STEP_SIZE * paper.ALPHA), COMPARED),
    "judge again": _part(arms((*SOLVING, *IMITATING)), JUDGE, begin=1),
}


def experiments(table: pd.DataFrame) -> list[Experiment]:
    """The experiment of each row."""
    return [
        replace(PARTS[part].settings(table)[arm], layout=LAYOUTS[place], seed=seed_of(place, k))
        for part, arm, place, k in table[NAMES].itertuples(index=False, name=None)
    ]


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
        stops = self.layouts.loc[[*COMPARED], [*difficulty.STOPS.values()]]
        return stops.set_axis([*difficulty.STOPS], axis=1)

    @cached_property
    def shares(self) -> pd.DataFrame:
        """The shares of layouts in which claims hold, as `shares` gives them."""
        return shares(by_layout(self.main, self.paths))

    @cached_property
    def tried(self) -> pd.DataFrame:
        """The cells of `picture` here and in layouts A to F, the nearest to the picture first.

        A learner that a variant does not change has its runs of the main table in it.
        """
        study = six.load()
        named, varied = study.runs, study.runs.variant != MAIN_TABLE
        variants = named.variant[varied & named.learner.isin(PAPER)].unique()
        settings = [
            (self.main, self.paths, MAIN_TABLE),
            (self.runs[self.runs.part == LARGER], self.paths, LARGER),
            (named[~varied], study.paths, MAIN_TABLE),
            *((groups(named, name)[0], study.paths, name) for name in variants),
        ]
        found = pd.concat([picture(*one) for one in settings if len(one[0])])
        return found.sort_values(
            ["whole", "answers"], ascending=False, kind="stable", ignore_index=True
        )


def of_table(table: pd.DataFrame) -> Drawn:
    """The runs of a table, with the published measures of the layouts."""
    made = experiments(table)
    known = table.drop(columns=["arm", "place", "k", "positions"], errors="ignore")
    rows = {
        e: {name: as_text(value) for name, value in asdict(e).items()} | one
        for e, one in zip(made, known.to_dict("records"), strict=True)
    }
    runs = pd.DataFrame([*rows.values()]).assign(cost_ratio=[*cost_ratios(rows).values()])
    layouts = difficulty.DIFFICULTY.table().set_index("place").rename_axis("layout")
    return Drawn(runs, _paths(table), layouts[[*difficulty.MEASURES, *difficulty.STOPS.values()]])


def _paths(table: pd.DataFrame) -> Paths:
    """The positions [m] of rows that were made here, or the published ones; nan after a failure."""
    if "positions" in table:
        where = np.array([*table.positions.dropna()])
    else:
        table, where = POPULATION.table(), published.arrays("population")["positions"]
    followed = [e for e in experiments(table) if e.learner in FOLLOWED]
    paths = np.where(where == NOWHERE, np.nan, where / MILLIMETRES)
    return dict(zip(followed, paths, strict=True))


@cache
def load() -> Drawn:
    """The published runs."""
    return of_table(POPULATION.table())


def by_layout(
    runs: pd.DataFrame, paths: Paths, claims: Iterable[str] = tuple(EXPECTED)
) -> pd.DataFrame:
    """Where each claim holds in runs of one setting, a row a claim and layout.

    Columns claim, layout (its name), yes, of (answers), holds and weaker (whether the weaker
    question holds there, if the claim has one; else as holds).
    """
    rows, there = [], {*runs.learner}
    for name in claims:
        if not {*CLAIMS[name].learners} <= there:
            continue
        strict, weaker = (
            one.dropna().astype(bool).groupby(level="layout", sort=False)
            for one in CLAIMS[name].asked(Observations(runs, paths))
        )
        counts = strict.agg(["sum", "size"]).join(weaker.mean().rename("weaker"))
        for layout, (yes, of, mild) in counts.iterrows():
            holds = (yes / of > MAJORITY, mild > MAJORITY)
            rows.append((name, name_of(layout), int(yes), int(of), *holds))
    return pd.DataFrame(rows, columns=["claim", "layout", "yes", "of", "holds", "weaker"])


def shares(where: pd.DataFrame) -> pd.DataFrame:
    """The share of the layouts of `by_layout` in which each claim holds, beside the expected share.

    Columns claim, holding, layouts, share, low, high (by `rate`), outcome (by the rule, weaker
    questions included), weaker (layouts in which the weaker question holds), expected (an outcome)
    and within (the share that was expected).
    """
    rows = []
    for name, group in where.groupby("claim", sort=False):
        of, expected = len(group), EXPECTED[str(name)]
        holding, weaker = int(group.holds.sum()), int(group.weaker.sum())
        found, outcome = rate(holding, of), forgiving(read(holding, of), read(weaker, of))
        within = expected.low <= found.value <= expected.high
        counts = name, holding, of, *astuple(found)
        rows.append((*counts, outcome, weaker, expected.outcome, within))
    names = ["claim", "holding", "layouts", "share", "low", "high"]
    return pd.DataFrame(rows, columns=[*names, "outcome", "weaker", "expected", "within"])


def succeeds(runs: pd.DataFrame, learner: str = "ES") -> pd.Series:
    """Whether a learner improves in each layout, by its name."""
    where = by_layout(runs, {}, [f"{learner} improves"])
    return where.set_index("layout").holds.astype(bool)


def _holding(claim: str, drawn: Drawn) -> Answer:
    """The answer to the number of layouts in which a claim holds."""
    for one in drawn.shares[drawn.shares.claim == claim].itertuples():
        return Answer(one.outcome, {"layouts": (one.holding, one.layouts)})
    return Answer(UNDECIDABLE)


def picture(runs: pd.DataFrame, paths: Paths, setting: str) -> pd.DataFrame:
    """The part of the paper's picture that holds in each cell of runs with all four answers.

    Columns layout and decay, of each of `PICTURE` the share of yes, whole (how many claims have
    nothing but yes), answers (the mean share) and setting.
    """
    answers = {name: BY_RUNS[name].answers(BY_RUNS[name].measure(runs, paths)) for name in PICTURE}
    cells = {name: yes.groupby(level=["layout", "decay"]).mean() for name, yes in answers.items()}
    found = pd.DataFrame(cells).dropna()
    found["whole"] = (found[[*PICTURE]] == 1).sum(axis=1)
    found["answers"] = found[[*PICTURE]].mean(axis=1)
    return found.reset_index().assign(setting=setting)


def whole_picture(tried: pd.DataFrame) -> Answer:
    """The answer of the cells of `Drawn.tried`."""
    found = int((tried.whole == len(PICTURE)).sum())
    numbers = {"tried": float(len(tried)), "most": float(tried.whole.max())}
    beside, said = {"settings": (found, len(tried))}, "found by search" if found else ""
    return Answer(REPRODUCED if found else NOT, numbers=numbers, beside=beside, said=said)


def closing_gaps(layouts: pd.DataFrame, judged: pd.Series) -> Answer:
    """The answer of the measures of layouts, and of whether ES improves in each."""
    closes = layouts.loc[judged.index, difficulty.PILOT] < CLOSES_BEFORE
    counts = {
        "layouts fail where it closes": count(~judged[closes]),
        "layouts succeed elsewhere": count(judged[~closes]),
    }
    outcomes = {read(*count) for count in counts.values()}
    worst = next(one for one in (NOT, UNDECIDABLE, PARTLY, REPRODUCED) if one in outcomes)
    return Answer(worst, counts)


def predictors(drawn: Drawn) -> Answer:
    """The answer of `predictor_scores` of whether ES improves."""
    tuned, judged = succeeds(drawn.runs[drawn.runs.part == "tune"]), succeeds(drawn.main)
    if tuned.empty or judged.empty:
        return Answer(UNDECIDABLE)
    ahead = predictor_scores(drawn.layouts, tuned, judged).ahead[[*difficulty.RIVALS]]
    lows, highs = ([getattr(one, end) for one in ahead] for end in ("low", "high"))
    outcome = above(min(lows), min(highs)) if np.isfinite(lows).all() else UNDECIDABLE
    beside = {"other measures surely behind": (sum(low > 0 for low in lows), len(lows))}
    return Answer(outcome, numbers={n: one.value for n, one in ahead.items()}, beside=beside)


def horizon(runs: pd.DataFrame) -> Answer:
    """The answer of the runs of all parts: the first seeds, with each horizon."""
    parts = {n: runs[runs.part == f"N = {n}"] for n in difficulty.HORIZONS}
    first = {*pd.concat(parts.values()).seed}
    parts[paper.HORIZON] = runs[(runs.part == "judge") & runs.seed.isin(first)]
    ends = pd.DataFrame({n: succeeds(one) for n, one in parts.items()}).dropna().astype(bool)
    failing = ends[~ends[paper.HORIZON]]
    return share(~failing[[*difficulty.HORIZONS]].any(axis=1), "layouts still fail")


def gaps_and_horizon(stops: pd.DataFrame) -> Answer:
    """The answer of `Drawn.stops`; nan where a rollout arrives on the whole grid."""
    known = stops[stops[paper.HORIZON].notna()]
    apart = known.max(axis=1, skipna=False) - known.min(axis=1, skipna=False)
    return share(apart <= difficulty.SAME_CLOSING + 1e-9, "layouts the same")


def caught(runs: pd.DataFrame, yes: str) -> Answer:
    """The share of layouts in which `yes`, an expression in columns, holds of all runs of ES.

    Only runs that do not arrive are asked.
    """
    away = runs[(runs.learner == "ES") & (runs.distance > ARRIVED)]
    answers = away.eval(yes)
    layouts = count(answers.groupby(away.layout).all())
    return Answer(read(*layouts), {"layouts": layouts, "runs": count(answers)})


def early_overshoot(runs: pd.DataFrame) -> Answer:
    """The answer of RDES's stopped runs in the reading per episode."""
    rdes = runs.query("learner == 'RDES' and decay == 'episode'")
    stopped = rdes[was_stopped(rdes)]
    early = stopped.steps_done < DEAD_BY * stopped.steps
    signs = pd.DataFrame({"layouts overshot": stopped.over > 0, "layouts early": early})
    most = signs.groupby(stopped.layout).mean() > MAJORITY
    counts = {str(name): count(most[name]) for name in most}
    beside = {"runs stopped": (len(stopped), len(rdes))}
    if stopped.empty:
        return Answer(UNDECIDABLE, counts, beside=beside)
    rates = [rate(*count) for count in counts.values()]
    ends = min(one.low for one in rates), min(one.high for one in rates)
    return Answer(above(*ends, MAJORITY), counts, beside=beside)


def raised() -> pd.Series:
    """The share by which the cost of the best theta rises with theta_c, by layout from A to F."""
    best = {layout: np.array(one.theta) for layout, one in six.load().searches.items()}
    return pd.Series({n: trap.raised_cost(n, best[n], CLIFF_RAISED) for n in sorted(best)})


def cliff(raised: pd.Series) -> Answer:
    """The answer of `raised`."""
    return share(raised >= CLIFF_COST, numbers={"most": float(raised.max())})


QUESTIONS = questions(__file__, {
    "closing gaps": lambda drawn: closing_gaps(drawn.layouts, succeeds(drawn.main)),
    "predictors": predictors,
    "horizon": lambda drawn: horizon(drawn.runs),
    "gaps and horizon": lambda drawn: gaps_and_horizon(drawn.stops),
    "trap": lambda drawn: caught(drawn.main, f"moved < {STANDING} and worth < 1"),
    "accurate and worse": lambda drawn: caught(
        drawn.main, "delta_last < delta_first and final_cost > initial_cost"),
    "cliff": lambda drawn: cliff(raised()),
    "early overshoot": lambda drawn: early_overshoot(drawn.main),
    "whole picture": lambda drawn: whole_picture(drawn.tried),
})  # fmt: skip

POPULATION = Investigation(
    name="population",
    parts=PARTS,
    questions=(
        *(
            Question(n, f"In how many layouts does {n} hold?", one.outcome, partial(_holding, n))
            for n, one in EXPECTED.items()
        ),
        *QUESTIONS,
    ),
    seed=seed_of,
    registered="46c248b",
    digits=6,
    arrays=("positions",),
    evidence=of_table,
    prepare=lambda missing: compile_ahead(
        [replace(it, layout=LAYOUTS[one.place]) for one, it in missing]
    ),
)
