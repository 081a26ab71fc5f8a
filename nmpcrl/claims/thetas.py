"""Theta after every episode of the published runs that a reader can follow.

Learning moves theta little in an episode. So numbers are stored in a form that compresses to half:
as the difference between the bits of each, read as an integer, and the bits of the one before.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Column

FOLLOWED = (design.MAIN_TABLE, "controls")  # parts of the study; the variants change one thing
SINGLE, BITS = np.dtype("<f4"), np.dtype("<u4")
ROWS, SHAPE, PLANES = "theta_rows", "theta_shape", "theta_planes"  # names of the arrays

Bytes = npt.NDArray[np.uint8]


def packed(
    summaries: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> dict[str, npt.NDArray[Any]]:
    """The arrays with theta of the runs that belong to `FOLLOWED`.

    Args:
        summaries: the runs, with a column theta where it is known.
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
    rows, shapes = np.array(list(known), int), np.array(columns.shape)
    return {ROWS: rows, SHAPE: shapes, PLANES: byte_planes(columns)}


def unpacked(arrays: Mapping[str, npt.NDArray[Any]]) -> dict[int, Column]:
    """Theta by the row of the run, of shape (episodes, d); nan after a run was stopped."""
    columns = numbers_of(arrays[PLANES]).reshape(arrays[SHAPE])
    return {int(row): theta.T for row, theta in zip(arrays[ROWS], columns, strict=True)}


def byte_planes(numbers: npt.ArrayLike) -> Bytes:
    """Single precision as differences of bits, the lowest bytes of all first; shape (4, count)."""
    bits = np.ravel(numbers).astype(SINGLE).view(BITS)
    steps = np.diff(bits, prepend=BITS.type(0))
    return np.ascontiguousarray(steps.view(np.uint8).reshape(-1, BITS.itemsize).T)


def numbers_of(planes: Bytes) -> Column:
    """The numbers that `byte_planes` was given, in a flat array."""
    steps = np.ascontiguousarray(planes.T).view(BITS)[:, 0]
    return np.cumsum(steps, dtype=BITS).view(SINGLE)
