"""What the population answers, by the definitions of `population_questions`.

Whatever is missing is left out: a layout answers what its runs can tell, and is not asked the rest.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.difficulty import MEASURES, OPEN, PILOT, RIVALS
from nmpcrl.analysis.predictors import Logistic, auc, brier, fit, over_layouts
from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.claims.by_runs import RunClaim
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.population_questions import (
    CLIFF_COST,
    CLOSES_BEFORE,
    DEAD_BY,
    EXPECTED,
    RESAMPLES,
    RIDGE,
    SAME_CLOSING,
    STANDING,
    WORDS,
)
from nmpcrl.claims.rule import MAJORITY, Observations, Paths, forgiving, read
from nmpcrl.claims.thresholds import improves, was_stopped
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome
from nmpcrl.claims.wider_claims import WIDER_CLAIMS
from nmpcrl.study import paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.population_design import HORIZONS, name_of

JUDGED = ("judge", "judge imitating", "judge again")  # parts


@dataclass(frozen=True)
class Answer:
    """What became of a question."""

    question: str
    outcome: Outcome
    counts: Mapping[str, tuple[int, int]] = field(default_factory=dict)  # yes of layouts, by part
    numbers: Mapping[str, float] = field(default_factory=dict)
    beside: Mapping[str, tuple[int, int]] = field(default_factory=dict)  # decides nothing
    said: str = ""  # of the outcome, where its own word says another thing than the rule did

    @property
    def words(self) -> str:
        """The outcome as a page says it."""
        return self.said or WORDS.get(self.outcome, str(self.outcome))


def by_share(
    name: str, yes: pd.Series, of: str = "layouts", numbers: Mapping[str, float] | None = None
) -> Answer:
    """The answer that a share gives, of layouts unless said."""
    count = _count(yes)
    return Answer(name, read(*count), {of: count}, numbers or {})


def asked() -> dict[str, RunClaim]:
    """The claims that are put to each layout, by their names in `EXPECTED`."""
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
    """Where each claim holds, a row a claim and layout that it could be put to.

    Args:
        runs: of `rows.table`, of one setting.
        paths: as `paper_claims.judge` takes them.
        claims: names in `EXPECTED`.
        called: what a layout is called, in the population unless said; `str` for A to F.

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
        for layout, (yes, of, share) in counts.iterrows():
            held_there = (yes / of > MAJORITY, share > MAJORITY)
            rows.append((name, called(layout), int(yes), int(of), *held_there))
    return pd.DataFrame(rows, columns=["claim", "layout", "yes", "of", "holds", "weaker"])


def shares(where: pd.DataFrame) -> pd.DataFrame:
    """In which share of the layouts each claim holds, beside what was expected.

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
        share, expected = rate(holding, layouts), EXPECTED[str(name)]
        numbers = (share.value, share.low, share.high)
        weaker = int(group.weaker.sum())
        outcome = forgiving(read(holding, layouts), read(weaker, layouts))
        said = (outcome, weaker, expected.outcome, share.value in expected)
        rows.append((name, holding, layouts, *numbers, *said))
    names = ["claim", "holding", "layouts", "share", "low", "high"]
    return pd.DataFrame(rows, columns=[*names, "outcome", "weaker", "expected", "within"])


def succeeds(runs: pd.DataFrame, learner: str = "ES") -> pd.Series:
    """Whether a learner improves in each layout, by its name in the population."""
    where = held(runs, {}, [f"{learner} improves"])
    return where.set_index("layout").holds.astype(bool)


def predictor_scores(difficulty: pd.DataFrame, tuned: pd.Series, judged: pd.Series) -> pd.DataFrame:
    """Each measure as a predictor of success, fitted on some layouts and scored on others.

    Args:
        difficulty: columns `MEASURES`, a row a layout.
        tuned: whether learning succeeds, by layout, for the fit.
        judged: the same of the layouts that it is scored on.

    Returns:
        A row a measure: slope (of the standardised measure), auc and brier, each an `Estimate`,
        and ahead, by how much the area of `PILOT` is larger (an `Estimate`; 0 for itself).
    """
    y = judged.to_numpy(bool)
    fits = {name: _fitted(difficulty[name], tuned) for name in MEASURES}
    probability = {name: one(difficulty.loc[judged.index, name]) for name, one in fits.items()}
    pilot = probability[PILOT]
    area = partial(over_layouts, auc, resamples=RESAMPLES)
    return pd.DataFrame(
        {
            name: {
                "slope": fits[name].slope,
                "auc": area(probability[name], y),
                "brier": over_layouts(brier, probability[name], y, resamples=RESAMPLES),
                "ahead": over_layouts(_ahead, pilot, probability[name], y, resamples=RESAMPLES),
            }
            for name in MEASURES
        }
    ).T


def _fitted(measure: pd.Series, success: pd.Series) -> Logistic:
    return fit(measure[success.index].to_numpy(float), success.to_numpy(bool), RIDGE)


def _ahead(first: np.ndarray, second: np.ndarray, success: np.ndarray) -> Any:
    return auc(first, success) - auc(second, success)


def closing_gaps(difficulty: pd.DataFrame, judged: pd.Series) -> Answer:
    """The question "closing gaps"."""
    closes = difficulty.loc[judged.index, PILOT] < CLOSES_BEFORE
    counts = {
        "layouts fail where it closes": _count(~judged[closes]),
        "layouts succeed elsewhere": _count(judged[~closes]),
    }
    return Answer("closing gaps", _both(counts.values()), counts)


def predictors(scores: pd.DataFrame) -> Answer:
    """The question "predictors", from `predictor_scores`."""
    ahead: dict[str, Estimate] = {name: scores.ahead[name] for name in RIVALS}
    lows, highs = ([getattr(one, end) for one in ahead.values()] for end in ("low", "high"))
    outcome = PARTLY
    if min(lows) > 0:
        outcome = REPRODUCED
    elif min(highs) < 0:
        outcome = NOT
    if not np.isfinite(lows).all():
        outcome = UNDECIDABLE
    numbers = {name: e.value for name, e in ahead.items()}
    beside = {"other measures surely behind": (sum(low > 0 for low in lows), len(lows))}
    return Answer("predictors", outcome, numbers=numbers, beside=beside)


def _predictors(difficulty: pd.DataFrame, tuned: pd.Series, judged: pd.Series) -> Answer:
    """`predictors`, where there is something to fit on and something to score on."""
    if tuned.empty or judged.empty:
        return Answer("predictors", UNDECIDABLE)
    return predictors(predictor_scores(difficulty, tuned, judged))


def horizon(runs: pd.DataFrame) -> Answer:
    """The question "horizon"; `runs` has all parts."""
    short = runs[(runs.part == "judge") & runs.seed.isin(_first_seeds(runs))]
    base = succeeds(short)
    longer = [succeeds(runs[runs.part == f"N = {n}"]) for n in HORIZONS]
    asked_of = [name for name in base.index[~base] if all(name in one.index for one in longer)]
    yes = [not any(one[name] for one in longer) for name in asked_of]
    count = (sum(yes), len(yes))
    return Answer("horizon", read(*count), {"layouts still fail": count})


def _first_seeds(runs: pd.DataFrame) -> set[int]:
    """The seeds of the parts with other horizons: the first of each layout."""
    return {*runs[runs.part.isin([f"N = {n}" for n in HORIZONS])].seed}


def gaps_and_horizon(stops: pd.DataFrame) -> Answer:
    """The question "gaps and horizon".

    Args:
        stops: theta_c at which a rollout stops arriving, a row a layout, a column a horizon; nan
            where it arrives on the whole grid.
    """
    known = stops[stops[paper.HORIZON].notna()]
    apart = known.max(axis=1, skipna=False) - known.min(axis=1, skipna=False)
    return by_share("gaps and horizon", apart <= SAME_CLOSING + 1e-9, "layouts the same")


def trap(runs: pd.DataFrame) -> tuple[Answer, Answer]:
    """The questions "trap" and "accurate and worse", of the runs of ES that do not arrive."""
    away = _of(runs, "ES").query(f"distance > {ARRIVED}")
    stands = (away.moved < STANDING) & (away.worth < 1)
    worse = (away.delta_last < away.delta_first) & (away.final_cost > away.initial_cost)
    found = []
    for name, yes in {"trap": stands, "accurate and worse": worse}.items():
        count = _count(yes.groupby(away.layout).all())
        found.append(Answer(name, read(*count), {"layouts": count, "runs": _count(yes)}))
    return found[0], found[1]


def at_the_gap(runs: pd.DataFrame, difficulty: pd.DataFrame) -> pd.DataFrame:
    """What became of each run of ES, and of the first gap of its layout; it was not asked before.

    `closed` is known when training has ended: a split by it depends on the outcome.

    Args:
        runs: of `rows.table`.
        difficulty: columns `MEASURES`, a row a layout.

    Returns:
        Columns improves (as `thresholds.improves`), away (from the target, at the end), closes
        (theta_c at which the gap does, `difficulty.OPEN` where there is none), gap (whether there
        is one) and closed (whether theta_c ended above the value at which it closes).
    """
    es = _of(runs, "ES").reset_index(drop=True)
    closes = difficulty[PILOT][es.layout.map(name_of)].to_numpy()
    gap = closes < OPEN
    found = {"improves": improves(es), "away": es.distance > ARRIVED, "closes": closes, "gap": gap}
    return pd.DataFrame(found | {"closed": gap & (es.theta_8 > closes)})


def improve_by_gap(ends: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """How many runs improve, of those in layouts with a gap: by whether it ended open or closed.

    Args:
        ends: of `at_the_gap`.
    """
    there = ends[ends.gap]
    return {
        "open": _count(there.improves[~there.closed]),
        "closed": _count(there.improves[there.closed]),
    }


def early_overshoot(runs: pd.DataFrame) -> Answer:
    """The question "early overshoot", of RDES's stopped runs in the reading per episode."""
    rdes = _of(runs, "RDES").query("decay == 'episode'")
    stopped = rdes[was_stopped(rdes)]
    early = stopped.steps_done < DEAD_BY * stopped.steps
    answers = {"layouts overshot": stopped.over > 0, "layouts early": early}
    counts = {
        name: _count(yes.groupby(stopped.layout).mean() > MAJORITY) for name, yes in answers.items()
    }
    known = [rate(*count) for count in counts.values() if count[1]]
    outcome = PARTLY
    if len(known) < len(counts):
        outcome = UNDECIDABLE
    elif min(one.low for one in known) > MAJORITY:
        outcome = REPRODUCED
    elif min(one.high for one in known) < MAJORITY:
        outcome = NOT
    runs_stopped = {"runs stopped": (len(stopped), len(rdes))}
    return Answer("early overshoot", outcome, counts, beside=runs_stopped)


def cliff(raised: pd.Series) -> Answer:
    """The question "cliff"; by which share the best theta's cost rises, by layout."""
    return by_share("cliff", raised >= CLIFF_COST, "layouts", {"most": float(raised.max())})


def extrapolation(compared: pd.DataFrame, intervention: str = "theta held") -> Answer:
    """The question "extrapolation", or the same of another intervention.

    Args:
        compared: of `extrapolation.compare`; the runs that are stopped without one are asked.
        intervention: which.
    """
    names = ["layout", "seed"]
    by = {name: some.set_index(names) for name, some in compared.groupby("intervention")}
    dead = by["none"].index[by["none"].stopped]
    survive = ~by[intervention].stopped.reindex(dead).dropna().astype(bool)
    return by_share("extrapolation", survive, f"survive, {intervention}")


def answers(
    runs: pd.DataFrame, difficulty: pd.DataFrame, stops: pd.DataFrame
) -> tuple[Answer, ...]:
    """All questions that the population alone decides; arguments as each function takes them."""
    main = runs[runs.part.isin(JUDGED)]
    tuned, judged = succeeds(runs[runs.part == "tune"]), succeeds(main)
    return (
        closing_gaps(difficulty, judged),
        _predictors(difficulty, tuned, judged),
        horizon(runs),
        gaps_and_horizon(stops),
        *trap(main),
        early_overshoot(main),
    )


def _of(runs: pd.DataFrame, learner: str) -> pd.DataFrame:
    return runs[runs.learner == learner]


def _count(yes: pd.Series) -> tuple[int, int]:
    return int(yes.sum()), len(yes)


def _both(counts: Iterable[tuple[int, int]]) -> Outcome:
    """Confirmed if both halves are, contradicted if one is."""
    outcomes = {read(*count) for count in counts}
    for one in (NOT, UNDECIDABLE):
        if one in outcomes:
            return one
    return REPRODUCED if outcomes == {REPRODUCED} else PARTLY
