"""The runs of the population as they were trained once, beside the study in `book/published`.

- `population.csv`: one row a run, numbers with six digits: its part, learner, layout (by name),
  decay and seed, then `rows.OUTCOME` and what `analysis.trap` tells;
- `population_paths.npz`: positions of the last rollouts of RDES and GES, in whole millimetres;
- `population_layouts.csv`: the measures of `analysis.difficulty`, one row a layout, and theta_c at
  which the compared layouts' rollouts stop arriving, by horizon;
- `population.json`: code, libraries, machine and hours.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis import difficulty, trap
from nmpcrl.analysis.rows import OUTCOME, as_text, cost_ratios, row
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims import published, whole_picture
from nmpcrl.claims.population import Answer, answers, held, shares
from nmpcrl.claims.population_questions import RAISED_TO, SAME_CLOSING
from nmpcrl.claims.published import Damaged, Unpublishable, place
from nmpcrl.claims.rule import Paths
from nmpcrl.study import paper
from nmpcrl.study.drawn import LAYOUTS
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import write_json
from nmpcrl.study.population_design import COMPARED, HORIZONS, name_of, whole_population
from nmpcrl.study.provenance import made_here
from nmpcrl.study.records import Column
from nmpcrl.study.sealed import seal_of

TABLE, PATHS, MEASURED, ABOUT = (
    f"population{name}" for name in (".csv", "_paths.npz", "_layouts.csv", ".json")
)
FOLLOWED = ("RDES", "GES")  # whose paths C5 compares
NAMED = ("part", "learner", "layout", "decay", "seed")
TRAP = ("moved", "worth", "delta_first", "delta_last", "phi_c")
MILLIMETRES = 1000
NOWHERE = np.iinfo(np.int16).min  # after a failed solve


@dataclass(frozen=True, eq=False)
class PopulationRuns:
    """What `claims.population` asks for."""

    runs: pd.DataFrame  # `rows.table` with `part` and what `trap` tells
    paths: Paths  # positions alone, shape (K + 1, 2)
    layouts: pd.DataFrame  # difficulty and where rollouts stop arriving, by the layout's name
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def stops(self) -> pd.DataFrame:
        """theta_c at which the compared layouts' rollouts stop arriving, a column a horizon."""
        horizons = (paper.HORIZON, *HORIZONS)
        return self.layouts.loc[[*COMPARED], [f"stops_{n}" for n in horizons]].set_axis(
            [*horizons], axis=1
        )

    @property
    def main(self) -> pd.DataFrame:
        """The runs that claims are put to."""
        return self.runs[self.runs.part.str.startswith("judge")]

    def shares(self) -> pd.DataFrame:
        """As `population.shares`."""
        return shares(held(self.main, self.paths))

    @cached_property
    def tried(self) -> pd.DataFrame:
        """As `whole_picture.everywhere`, with what is published of layouts A to F."""
        six = published.load()
        return whole_picture.everywhere(self.runs, self.paths, six.table, six.paths)

    def answers(self) -> tuple[Answer, ...]:
        """As `population.answers`, and `whole_picture.answer`."""
        found = answers(self.runs, self.layouts[[*difficulty.MEASURES]], self.stops)
        return (*found, whole_picture.answer(self.tried))


def measured() -> pd.DataFrame:
    """The table of layouts, made anew, which takes some minutes; nothing is trained."""
    grid = np.arange(0, RAISED_TO + 1e-9, SAME_CLOSING)
    found = pd.DataFrame({name: difficulty.as_row(centres) for name, centres in LAYOUTS.items()}).T
    for horizon in (paper.HORIZON, *HORIZONS):
        stops = {n: difficulty.stops_arriving(LAYOUTS[n], horizon, grid) for n in COMPARED}
        found[f"stops_{horizon}"] = pd.Series(stops, dtype=float)
    return found


def publish(
    summaries: Mapping[Experiment, RunSummary], layouts: pd.DataFrame | None = None
) -> Path:
    """Write all files anew; the same content gives the same bytes, but for the date.

    Args:
        summaries: runs of `population_design.whole_population`.
        layouts: of `measured`, if they are known already.

    Returns:
        Where they are.
    """
    folder = place()
    folder.mkdir(parents=True, exist_ok=True)
    runs = _rows(summaries)
    runs.to_csv(folder / TABLE, index=False, float_format="%.6g")
    arrays: dict[str, Any] = {"positions": _positions(summaries)}
    np.savez_compressed(folder / PATHS, **arrays)
    known = measured() if layouts is None else layouts
    known.to_csv(folder / MEASURED, index_label="layout", float_format="%.9g")
    _seal(folder, made_here() | effort(runs, "part"))
    return folder


def extend(summaries: Mapping[Experiment, RunSummary]) -> Path:
    """Publish further runs beside those that are there, which stay as they are to the last byte.

    Args:
        summaries: as of `publish`, which writes them where nothing is published yet.

    Returns:
        Where they are.

    Raises:
        Damaged: what is published is not what was written.
        Unpublishable: a run is there already.
    """
    folder = place()
    if not (folder / ABOUT).exists():
        return publish(summaries)
    found, runs = load(), _rows(summaries)
    both = pd.concat([found.runs.assign(layout=found.runs.layout.map(name_of)), runs])
    if (again := both.duplicated([*NAMED])).any():
        one = both[again].iloc[0]
        raise Unpublishable(f"{one.learner} in layout {one.layout} is published already")
    with np.load(folder / PATHS, allow_pickle=False) as file:
        arrays: dict[str, Any] = {"positions": _joined(file["positions"], _positions(summaries))}
    with (folder / TABLE).open("a", encoding="utf-8") as table:
        runs.to_csv(table, index=False, header=False, float_format="%.6g")
    np.savez_compressed(folder / PATHS, **arrays)
    addition, about = made_here() | effort(runs, "part"), dict(found.about)
    more = {"additions": [*about.get("additions", []), addition]}
    _seal(folder, about | more | {"runs": about["runs"] | addition["runs"]})
    return folder


def _seal(folder: Path, about: Mapping[str, Any]) -> None:
    whole = {**about, "files": sums(folder, (TABLE, PATHS, MEASURED))}
    write_json(folder / ABOUT, whole | {"seal": seal_of(whole)}, indent=1)
    _load.cache_clear()


def load() -> PopulationRuns:
    """What is published of the population.

    Raises:
        Damaged: it is not there, or not what was written.
    """
    return _load(place())


@cache
def _load(folder: Path) -> PopulationRuns:
    try:
        about = json.loads((folder / ABOUT).read_text("utf-8"))
        if about["seal"] != seal_of(about) or about["files"] != sums(
            folder, (TABLE, PATHS, MEASURED)
        ):
            raise ValueError("a file is not the one that was written")
        kept = pd.read_csv(folder / TABLE)
        with np.load(folder / PATHS, allow_pickle=False) as file:
            positions = file["positions"]
        layouts = pd.read_csv(folder / MEASURED, index_col="layout")
        return _restored(kept, positions, layouts, about)
    except (OSError, ValueError, LookupError) as error:
        raise Damaged(
            f"the population is not published whole in {folder} ({error});"
            " `nmpcrl study --population --publish` makes it anew"
        ) from error


def _rows(summaries: Mapping[Experiment, RunSummary]) -> pd.DataFrame:
    parts = whole_population()
    return pd.DataFrame([_row(one, parts[e]) for e, one in summaries.items()])


def _positions(summaries: Mapping[Experiment, RunSummary]) -> Column:
    """Of the last rollouts of those whose paths are kept."""
    return _shortened([one.states for e, one in summaries.items() if e.learner in FOLLOWED])


def _joined(first: Column, second: Column) -> Column:
    """Positions of some runs before those of others; either may be none."""
    there = [one for one in (first, second) if len(one)]
    return np.concatenate(there) if there else first


def _row(summary: RunSummary, part: str) -> dict[str, Any]:
    """The row of a run, named by its part and the name of its layout."""
    experiment, whole = summary.name, row(summary)
    named = {name: getattr(experiment, name) for name in NAMED if name != "part"}
    named |= {"part": part, "layout": name_of(experiment.layout)}
    told = trap.as_row(summary)
    numbers = {name: whole[name] for name in OUTCOME} | {name: told[name] for name in TRAP}
    return {name: named[name] for name in NAMED} | numbers


def _restored(
    kept: pd.DataFrame, positions: Column, layouts: pd.DataFrame, about: Mapping[str, Any]
) -> PopulationRuns:
    """The rows with all fields of their experiments, as `rows.table` has them."""
    named = {
        (part, e.learner, name_of(e.layout), e.decay, e.seed): e
        for e, part in whole_population().items()
    }
    experiments = [named[one] for one in kept[[*NAMED]].itertuples(index=False, name=None)]
    rows = {
        e: {name: as_text(value) for name, value in asdict(e).items()}
        | {"part": one["part"]}
        | {name: one[name] for name in (*OUTCOME, *TRAP)}
        for e, one in zip(experiments, kept.to_dict("records"), strict=True)
    }
    ratios = cost_ratios(rows)
    runs = pd.DataFrame([one | {"cost_ratio": ratios[e]} for e, one in rows.items()])
    followed = [e for e in experiments if e.learner in FOLLOWED]
    paths = dict(zip(followed, _lengthened(positions), strict=True))
    return PopulationRuns(runs, paths, layouts, about)


def _shortened(states: list[Column]) -> Column:
    """Positions of rollouts in whole millimetres."""
    if not states:
        return np.zeros((0, 0, 2), np.int16)
    where = np.array(states)[..., :2] * MILLIMETRES
    return np.where(np.isfinite(where), np.round(where), NOWHERE).astype(np.int16)


def _lengthened(positions: Column) -> Column:
    """The positions in metres again; nan after a failed solve."""
    result: Column = np.where(positions == NOWHERE, np.nan, positions / MILLIMETRES)
    return result


def sums(folder: Path, files: Iterable[str]) -> dict[str, str]:
    """What tells that files belong together and are whole."""
    contents = {name: (folder / name).read_bytes() for name in files}
    return {name: sha256(content).hexdigest() for name, content in contents.items()}


def effort(runs: pd.DataFrame, part: str) -> dict[str, Any]:
    """How many runs each part has, which a column tells, and how long all took."""
    counts = runs[part].value_counts(sort=False).to_dict()
    return {"runs": counts, "hours": float(runs.seconds.sum() / 3600)}
