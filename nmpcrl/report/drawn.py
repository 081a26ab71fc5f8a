"""The drawn layouts as a page shows them: in short, claim by claim, the nearest to the paper."""

import pandas as pd

from nmpcrl.analysis.statistics import count
from nmpcrl.claims.thresholds import improves
from nmpcrl.studies.difficulty import OPEN, PILOT
from nmpcrl.studies.population import CLAIMS, IMPROVES, Drawn
from nmpcrl.study.drawn import name_of
from nmpcrl.study.layouts import ARRIVED


def at_the_gap(found: Drawn) -> pd.DataFrame:
    """The end of each judged run of ES, and the first gap of its layout; no registered question.

    `closed` is known when training has ended: a split by it depends on the outcome.

    Returns:
        Columns improves (as `thresholds.improves`), away (from the target, at the end), closes
        (theta_c at which the gap does, `difficulty.OPEN` where there is none), gap (whether there
        is one) and closed (whether theta_c ended above the value at which it closes).
    """
    es = found.main[found.main.learner == "ES"].reset_index(drop=True)
    closes = found.layouts[PILOT][es.layout.map(name_of)].to_numpy()
    ends = {"improves": improves(es), "away": es.distance > ARRIVED, "closes": closes}
    gap = closes < OPEN
    return pd.DataFrame(ends | {"gap": gap, "closed": gap & (es.theta_8 > closes)})


def improve_by_gap(ends: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """Runs of `at_the_gap` that improve, and all, where a gap ended open, and where closed."""
    ways = {"open": ends.gap & ~ends.closed, "closed": ends.closed}
    return {way: count(ends.improves[there]) for way, there in ways.items()}


def label(claim: str) -> str:
    """A claim of `EXPECTED`, and in few words what it says."""
    short = CLAIMS[claim].short.replace("\n", " ")
    return claim if claim in IMPROVES else f"{claim}: {short}"
