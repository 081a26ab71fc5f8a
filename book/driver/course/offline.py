"""Stored runs for the editions, so that no notebook of them takes longer than two minutes.

Every chapter says what it needs, with the parameters of the editions; what of that is not stored
is trained first. Summaries are small, and all of them are taken. A whole run takes up to 11 MB:
those are taken that are long to train, and a notebook trains the others.
"""

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from driver.build import chapters, train
from driver.course import editions
from driver.project import ROOT

LONG = 6  # of a run [s], as `limits.seconds_of` has it: those whose learner fits a network


def stored(files: Iterable[str]) -> dict[str, Path]:
    """What the chapters in these files need stored: path in the folder of an edition -> file."""
    from nmpcrl.analysis.summaries import SUMMARIES  # only here: it takes long to import
    from nmpcrl.study.files import folder
    from nmpcrl.study.store import RUNS

    whole, summarised = needed(files)
    train.train(whole, summarised)
    paths = [*map(RUNS.path_of, whole), *map(SUMMARIES.path_of, summarised)]
    # what another solver had to solve is not stored; a notebook does that again
    there = filter(Path.exists, paths)
    return {f"data/runs/{path.relative_to(folder())}": path for path in there}


def needed(files: Iterable[str]) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The runs, and the runs of which the summaries, are to be stored."""
    from nmpcrl.study.limits import seconds_of

    paths = [ROOT / "book" / file for file in files]
    needs = chapters.together(chapters.ask(path, given(path)) for path in paths)
    return tuple(one for one in needs.experiments if seconds_of(one) > LONG), needs.summaries


def given(notebook: Path) -> dict[str, Any]:
    """The parameters of a chapter that its editions change."""
    names = chapters.parameters(notebook)
    return {name: value for name, value in editions.OFFLINE.items() if name in names}


def copy(stored: Mapping[str, Path], place: Path) -> None:
    """Copy what is stored to the folder of an edition."""
    for name, path in stored.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, place / name)
