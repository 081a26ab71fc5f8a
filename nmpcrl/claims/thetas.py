"""Theta after every episode of the published runs that a reader can follow: `thetas.npz`.

Learning moves theta by little in an episode, so numbers are kept as what compresses to half: how
the bits of each, read as an integer, differ from those of the one before.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Column

FILE = "thetas.npz"
FOLLOWED = (design.MAIN_TABLE, "controls")  # parts of the study; in the others something is changed
SINGLE, BITS = np.dtype("<f4"), np.dtype("<u4")

Bytes = npt.NDArray[np.uint8]


def save(
    folder: Path, summaries: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> None:
    """Write theta of the runs that belong to `FOLLOWED`.

    Args:
        folder: where to.
        summaries: the runs, with their column theta where it is known.
        variants: the part of the study that each belongs to.
    """
    known = {
        row: one.episodes["theta"].T
        for row, (e, one) in enumerate(summaries.items())
        if variants[e] in FOLLOWED and "theta" in one.episodes
    }
    shape = np.max([theta.shape for theta in known.values()] or [(0, 0)], axis=0)
    columns = np.full((len(known), *shape), np.nan, SINGLE)
    for into, theta in zip(columns, known.values(), strict=True):
        into[:, : theta.shape[1]] = theta
    kept: dict[str, Any] = {
        "rows": np.array(list(known), int),
        "shape": columns.shape,
        "planes": byte_planes(columns),
    }
    np.savez_compressed(folder / FILE, **kept)


def load(folder: Path) -> dict[int, Column]:
    """Theta by the row of runs.csv, of shape (episodes, d); nan after a run was stopped."""
    with (folder / FILE).open("rb") as whole, np.load(whole, allow_pickle=False) as file:
        rows, shape, planes = file["rows"], file["shape"], file["planes"]
    columns = numbers_of(planes).reshape(shape)
    return {int(row): theta.T for row, theta in zip(rows, columns, strict=True)}


def byte_planes(numbers: npt.ArrayLike) -> Bytes:
    """Single precision as differences of bits, the lowest bytes of all first; shape (4, count)."""
    bits = np.ravel(numbers).astype(SINGLE).view(BITS)
    steps = np.diff(bits, prepend=BITS.type(0))
    return np.ascontiguousarray(steps.view(np.uint8).reshape(-1, BITS.itemsize).T)


def numbers_of(planes: Bytes) -> Column:
    """What `byte_planes` was given, one after the other."""
    steps = np.ascontiguousarray(planes.T).view(BITS)[:, 0]
    return np.cumsum(steps, dtype=BITS).view(SINGLE)
