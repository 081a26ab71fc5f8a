"""A file of its own beside the published study, to which parts are added and none is changed."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.kept import Kept, Wanted
from nmpcrl.claims.published import Damaged, Unpublishable, place
from nmpcrl.study import sealed
from nmpcrl.study.provenance import made_here
from nmpcrl.study.storage.atomic import write_json


@dataclass(frozen=True)
class Extendable:
    """A file that is sealed each time, so that a change by hand is noticed."""

    name: str  # of the file
    what: str  # it holds, in words
    command: str  # that makes it

    @property
    def path(self) -> Path:
        """Where it is."""
        return place() / self.name

    def begun(self, **empty: Any) -> dict[str, Any]:
        """What is there, or what it begins with.

        Raises:
            Damaged: as `content`.
        """
        return self.content(self.path) if self.path.exists() else {**empty, "about": []}

    def content(self, path: Path) -> dict[str, Any]:
        """What is there.

        Raises:
            Damaged: it is not there, or not what was written.
        """
        try:
            return sealed.content_of(path)
        except sealed.DAMAGE as error:
            raise self.damaged(path, error) from error

    def write(self, content: Mapping[str, Any]) -> Path:
        """Write it, with where and by what it was made put beside what says that of the rest."""
        plain = {name: one for name, one in content.items() if name != "seal"}
        plain["about"] = [*content["about"], made_here()]
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_json(self.path, plain | {"seal": sealed.seal_of(plain)})
        return self.path

    def damaged(self, path: Path, error: Exception) -> Damaged:
        """What is said of it where it is not what it should be."""
        return Damaged(
            f"{self.what} is not published whole in {path} ({error});"
            f" `{self.command}` makes it anew"
        )


RUN = ("part", "arm", "place", "k")  # what names a run, k being the number of the seed


def whole_arms(
    kept: Kept[Any], runs: Iterable[Wanted], seed_of: Callable[[str, int], int]
) -> pd.DataFrame:
    """The table of what is kept of some runs, but arms that are not there whole.

    Args:
        kept: where; the fields of its results are columns behind those of `RUN`.
        runs: whose entries are "PART: ARM".
        seed_of: (place, k) -> seed.
    """
    every, columns = tuple(runs), (*RUN, *(one.name for one in fields(kept.result)))
    there = kept.stored(every)
    missing = {one.entry for one in every if one not in there}
    rows = []
    for one, made in there.items():
        if one.entry not in missing:
            part, _, arm = one.entry.partition(": ")
            named = (part, arm, one.layout, one.seed - seed_of(one.layout, 0))
            rows.append({**dict(zip(RUN, named, strict=True)), **asdict(made)})
    return pd.DataFrame(rows, columns=[*columns])


@dataclass(frozen=True, eq=False)
class Table:
    """What is published."""

    table: pd.DataFrame
    about: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Arms:
    """A file that has by part and arm what was run there, run by run.

    Numbers are rounded, and null where one is not finite; the processor time is that of all runs
    together.
    """

    held: Extendable
    columns: tuple[str, ...]  # of the table: those of `RUN`, what is measured, and "seconds"
    runs: Callable[[str, str], Sequence[tuple[str, int]]]  # place and k of each, by part and arm
    digits: int

    def extend(self, table: pd.DataFrame) -> Path:
        """Publish whole arms beside those that are there, which stay as they are.

        Args:
            table: with `columns`; an arm that is published already is left out of it if it says
                the same.

        Returns:
            The file.

        Raises:
            Damaged: what is published is not what was written.
            Unpublishable: an arm is not whole, or is published otherwise, or nothing is new.
        """
        content, new = self.held.begun(parts={}), False
        for (part, arm), runs in table.groupby(["part", "arm"], sort=False):
            block, arms = self._block(part, arm, runs), content["parts"].setdefault(part, {})
            if arm in arms:
                if arms[arm] | {"seconds": 0} != block | {"seconds": 0}:
                    where = f"in the part {part!r}"
                    raise Unpublishable(f"{arm} is published already {where}, otherwise")
                continue
            arms[arm], new = block, True
        if not new:
            raise Unpublishable(f"nothing of {self.held.what} is whole and new")
        path = self.held.write(content)
        _load.cache_clear()
        return path

    def load(self) -> Table:
        """What is published.

        Raises:
            Damaged: it is not there, or not what was written.
        """
        return _load(self, self.held.path)

    @property
    def _measured(self) -> tuple[str, ...]:
        return tuple(one for one in self.columns if one not in (*RUN, "seconds"))

    def _block(self, part: str, arm: str, runs: pd.DataFrame) -> dict[str, Any]:
        """The runs of one arm.

        Raises:
            Unpublishable: they are not those of the part.
        """
        by, order = runs.set_index(["place", "k"]), list(self.runs(part, arm))
        if {*by.index} != {*order} or len(by) != len(order):
            raise Unpublishable(f"{arm} has {len(by)} of {len(order)} runs of the part {part!r}")
        there = by.loc[order]
        return {
            **{name: _plain(there[name].tolist(), self.digits) for name in self._measured},
            "seconds": rounded(float(there.seconds.sum()), 4),
        }

    def rows(self, part: str, arm: str, block: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """The runs of one arm, as they are read."""
        order = self.runs(part, arm)
        for i, (where, k) in enumerate(order):
            yield {
                "part": part, "arm": arm, "place": where, "k": k,
                **{name: _read(block[name][i]) for name in self._measured},
                "seconds": block["seconds"] / len(order),
            }  # fmt: skip


@cache
def _load(arms: Arms, path: Path) -> Table:
    content = arms.held.content(path)
    try:
        rows = [
            row
            for part, by_arm in content["parts"].items()
            for arm, block in by_arm.items()
            for row in arms.rows(part, arm, block)
        ]
        return Table(pd.DataFrame(rows, columns=[*arms.columns]), {"made": content["about"]})
    except (ValueError, LookupError, TypeError) as error:
        raise arms.held.damaged(path, error) from error


def _plain(value: Any, digits: int) -> Any:
    """As JSON has it."""
    if isinstance(value, list):
        return [_plain(one, digits) for one in value]
    return rounded(value, digits) if isinstance(value, float) else value


def _read(value: Any) -> Any:
    """As it was before, with infinity for null."""
    if isinstance(value, list):
        return [_read(one) for one in value]
    return np.inf if value is None else value


def rounded(value: float, digits: int) -> float | None:
    """A number as it is published; None where it is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None
