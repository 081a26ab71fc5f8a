"""The question "whole picture": is there a setting in which the paper's claims hold together?

A cell is a layout and a reading of the decay in a setting: the main table, or a variant of it.
"""

from collections.abc import Iterator

import pandas as pd

from nmpcrl.claims.population import JUDGED, Answer, asked
from nmpcrl.claims.robustness import groups
from nmpcrl.claims.rule import Paths
from nmpcrl.claims.verdict import NOT, REPRODUCED, UNDECIDABLE
from nmpcrl.study.design import MAIN_TABLE
from nmpcrl.study.experiment import PAPER

PICTURE = ("C1", "C2", "C5", "C9")


def picture(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """How much of the paper's picture holds in each layout and reading, the most first.

    Args:
        runs: of one setting, with all four of the paper's learners.
        paths: as `paper_claims.judge` takes them.

    Returns:
        Columns layout and decay, of each of `PICTURE` the share of yes, whole (how many claims have
        nothing but yes) and answers (the mean share); cells in which all four were answered.
    """
    known, columns = asked(), {}
    for name in PICTURE:
        claim = known[name]
        answers = claim.yes(claim.measure(runs, paths), claim.threshold).dropna().astype(float)
        columns[name] = answers.groupby(level=["layout", "decay"]).mean()
    found = pd.DataFrame(columns).dropna()
    found["whole"] = (found[[*PICTURE]] == 1).sum(axis=1)
    found["answers"] = found[[*PICTURE]].mean(axis=1)
    return _nearest_first(found.reset_index())


def everywhere(
    drawn: pd.DataFrame, drawn_paths: Paths, six: pd.DataFrame, six_paths: Paths
) -> pd.DataFrame:
    """All cells that were tried, the nearest to the whole picture first.

    Args:
        drawn: runs in drawn layouts, with their `part`.
        drawn_paths: theirs, as `paper_claims.judge` takes them.
        six: runs in A to F, with their `variant`.
        six_paths: theirs.

    Returns:
        The columns of `picture`, and setting: `MAIN_TABLE`, or what is changed.
    """
    found = [
        picture(runs, drawn_paths).assign(setting=name) for name, runs in _drawn_settings(drawn)
    ]
    found += [picture(runs, six_paths).assign(setting=name) for name, runs in _six_settings(six)]
    return _nearest_first(pd.concat(found))


def answer(tried: pd.DataFrame) -> Answer:
    """What became of the question; `tried` is of `everywhere`."""
    if tried.empty:
        return Answer("whole picture", UNDECIDABLE)
    found = int((tried.whole == len(PICTURE)).sum())
    numbers = {"tried": float(len(tried)), "most": float(tried.whole.max())}
    outcome = REPRODUCED if found else NOT
    beside, said = {"settings": (found, len(tried))}, "found by search" if found else ""
    return Answer("whole picture", outcome, numbers=numbers, beside=beside, said=said)


def _drawn_settings(runs: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    yield MAIN_TABLE, runs[runs.part.isin(JUDGED)]
    for part in runs.part[runs.part.str.startswith("alpha")].unique():
        yield str(part), runs[runs.part == part]


def _six_settings(runs: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """A learner that a variant does not change stands in it as in the main table."""
    yield MAIN_TABLE, runs[runs.variant == MAIN_TABLE]
    for name in runs.variant[runs.learner.isin(PAPER)].unique():
        if name != MAIN_TABLE:
            yield str(name), groups(runs, name)[0]


def _nearest_first(found: pd.DataFrame) -> pd.DataFrame:
    return found.sort_values(
        ["whole", "answers"], ascending=False, kind="stable", ignore_index=True
    )
