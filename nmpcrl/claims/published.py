"""The whole study as it was trained once, in `book/published`, small enough to go with the book.

- `runs.csv`: one row a run, `rows.row`, with the part of the study it belongs to and its key;
- `curves.npz`: what figures need of each, in the same order: training cost by episode, cost and
  theta of the rollouts without noise, and the states of the last one;
- `thetas.npz`: theta after every episode, of the runs that a reader can follow (see `thetas`);
- `searches.json`: the best theta that `analysis.search` finds in each layout;
- `timings.csv`: of `time_learners`, on which the verdicts on time rest;
- `about.json`: code, libraries and machine, and when the thresholds were fixed.
"""

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

import nmpcrl
from nmpcrl.analysis import search
from nmpcrl.analysis.rows import FIELDS, OLDER, OUTCOME, cost_ratios, experiment_of, row
from nmpcrl.analysis.search import Found, Search
from nmpcrl.analysis.summary import Outline, RunSummary
from nmpcrl.bench.learners import ratio
from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import assumptions, thetas
from nmpcrl.claims.assumptions import Measured
from nmpcrl.claims.failure_modes import (
    WELL,
    Ending,
    Failure,
    Mechanism,
    failure_mode,
    failure_modes,
    went_wrong,
)
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.rule import Claim, Observations
from nmpcrl.claims.verdict import Verdict
from nmpcrl.claims.wider_claims import WIDER_CLAIMS, WIDER_THAN
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.parameters import Refusal, shortened
from nmpcrl.study.provenance import made_here, summary_key
from nmpcrl.study.records import Column
from nmpcrl.study.sealed import seal_of
from nmpcrl.study.storage.atomic import write_json

FILES = (
    *("runs.csv", "curves.npz", thetas.FILE, "searches.json", "timings.csv"),
    "about.json",
)
# Columns of `failure_modes`, and what may be in them; the frozen arms have none.
WORDS = {
    "ending": {*Ending, ""},
    "wrong": {*Failure, ""},
    "mechanism": {*Mechanism, WELL, ""},
}
FAILURE_MODE = [*WORDS, "episode"]
# Columns of `runs.csv`; those that are younger than it are missing, and a metric is then not known.
COLUMNS = (*FIELDS, *OUTCOME, "variant", "key", *FAILURE_MODE)


WIDER = {old: new for new, old in WIDER_THAN.items()}
EVERY: dict[str, Claim] = {  # in the order of the verdicts
    **{
        one: {**CLAIMS, **WIDER_CLAIMS}[one]
        for claim in CLAIMS
        for one in (claim, *filter(None, [WIDER.get(claim)]))
    },
    **OWN_CLAIMS,
}
AUDITED = Experiment("GES")  # the run in which the assumptions of C8 are measured

CHECKOUT = "`git checkout -- book/published` restores what came with the project,"
ELSEWHERE = (
    "it comes with the project's repository and not with an installed package: set"
    " NMPCRL_PUBLISHED to its folder book/published there;"
)


class Damaged(Refusal):
    """What is published is not there, or not what was written."""


@dataclass(frozen=True, eq=False)
class Published:
    """The published study; theta after every episode is kept of some runs, as `thetas` says."""

    summaries: Mapping[Experiment, Outline] = field(default_factory=dict)  # single precision
    variants: Mapping[Experiment, str] = field(default_factory=dict)  # the part each belongs to
    rows: Mapping[Experiment, dict[str, Any]] = field(default_factory=dict)  # of `runs.csv`
    timings: pd.DataFrame = field(default_factory=pd.DataFrame)  # of `time_learners`
    about: Mapping[str, Any] = field(default_factory=dict)
    searches: Mapping[Search, Found] = field(default_factory=dict)

    @cached_property
    def table(self) -> pd.DataFrame:
        """All rows, with `cost_ratio` as `rows.table` has it."""
        ratios = cost_ratios(self.rows)
        return pd.DataFrame(
            [row | {"cost_ratio": ratios[e]} for e, row in self.rows.items()],
        )

    @property
    def paths(self) -> dict[Experiment, Column]:
        """States of each run's last rollout, as `paper_claims.judge` takes them."""
        return {e: one.states for e, one in self.summaries.items()}

    @property
    def main(self) -> pd.DataFrame:
        """The rows of the main table."""
        parts = self.variants.items()
        return pd.DataFrame([self.rows[e] for e, part in parts if part == design.MAIN_TABLE])

    @property
    def batches(self) -> tuple[Mapping[str, Any], ...]:
        """When, where, with what and how long the runs were trained that were published together.

        The first is of the study as it was published first; `extend` added the others.
        """
        return (self.about, *self.about.get("additions", ())) if self.rows else ()

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """On the paper's claims, each followed by the one that is wider, and on our own."""
        return tuple(map(self.verdict, EVERY)) if self.rows else ()

    @cache  # noqa: B019 - there is one for a process
    def verdict(self, claim: str) -> Verdict:
        """The verdict on a claim, from what is published alone."""
        return EVERY[claim].judge(self._added if claim in OWN_CLAIMS else self._main)

    @cached_property
    def _main(self) -> Observations:
        """Judged for all claims but our own."""
        runs, audited = self.table, self.about.get("audit")
        made = assumptions.audit(AUDITED, Measured(**audited)) if audited else ()
        return Observations(runs[runs.variant == design.MAIN_TABLE], self.paths, self.timings, made)

    @cached_property
    def _added(self) -> Observations:
        return Observations(self.table[self.table.variant.isin(thetas.FOLLOWED)])

    def ratio(self, solver: str, learner: str) -> Ratio:
        """Time of a learner's step over that of one of ES, as `bench.learners.ratio` has it."""
        return ratio(self.timings, solver, learner)


def place() -> Path:
    """The folder, or what the environment variable NMPCRL_PUBLISHED says."""
    beside = Path(nmpcrl.__file__).parent.parent / "book" / "published"
    return Path(os.environ.get("NMPCRL_PUBLISHED") or beside)


def _restore() -> str:
    """How to get what is published, in a checkout of the project and elsewhere."""
    known = CHECKOUT if (Path(nmpcrl.__file__).parents[1] / ".git").exists() else ELSEWHERE
    return f"{known} `nmpcrl study --publish` makes it anew"


def publish(
    summaries: Mapping[Experiment, RunSummary],
    variants: Mapping[Experiment, str],
    timings: pd.DataFrame | None = None,
    searches: Mapping[Search, Found] = MappingProxyType({}),
    audit: Measured | None = None,
) -> Path:
    """Write all files anew; the same content gives the same bytes, but for the date.

    Args:
        summaries: the runs.
        variants: the part of the study that each belongs to.
        timings: of `time_learners`, if there were any taken.
        searches: for the best theta.
        audit: of `AUDITED`.

    Returns:
        Where they are.
    """
    folder = place()
    folder.mkdir(parents=True, exist_ok=True)
    labels = {e: {"variant": variants[e], "key": summary_key(e)} for e in summaries}
    runs = pd.DataFrame([row(one) | labels[e] for e, one in summaries.items()])
    runs = runs.join(failure_modes_of(summaries))
    runs.to_csv(folder / "runs.csv", index=False)
    curves: dict[str, Any] = _curves(list(summaries.values()))
    np.savez_compressed(folder / "curves.npz", **curves)
    thetas.save(folder, summaries, variants)
    write_json(folder / "searches.json", search.as_lists(searches))
    (pd.DataFrame() if timings is None else timings).to_csv(folder / "timings.csv", index=False)
    made = _timed(timings) | ({"searches": made_here()} if searches else {})
    made |= {"audit": asdict(audit)} if audit else {}
    _seal(folder, made_here() | made | effort(runs, "variant") | _fixed(folder))
    return folder


def republish(timings: pd.DataFrame) -> Path:
    """Publish times of `time_learners` that were measured just now; all else stays.

    Returns:
        Where they are.

    Raises:
        Damaged: what is published is not what `publish` wrote.
    """
    found, folder = load(), place()
    timings.to_csv(folder / "timings.csv", index=False)
    _seal(folder, {**found.about, **_timed(timings)})
    return folder


class Unpublishable(Refusal):
    """Runs cannot be put beside those that are published."""


def extend(summaries: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]) -> Path:
    """Publish further runs beside those that are there, which stay as they are to the last byte.

    Args:
        summaries: the runs.
        variants: the part of the study that each belongs to: none of `thetas.FOLLOWED`.

    Returns:
        Where they are.

    Raises:
        Damaged: what is published is not what `publish` wrote.
        Unpublishable: a run is there already, or lacks its frozen arm there, or differs in a field
            for which the published table has no column.
    """
    found, folder = load(), place()
    header = pd.read_csv(folder / "runs.csv", nrows=0).columns.tolist()
    rows = [_row_beside(found, e, one, variants[e], header) for e, one in summaries.items()]
    runs = pd.DataFrame(rows, columns=header)
    with (folder / "curves.npz").open("rb") as whole, np.load(whole, allow_pickle=False) as file:
        curves = {name: file[name] for name in file.files}
    more = _curves(list(summaries.values()))
    joined: dict[str, Any] = {name: _below(curves[name], more[name]) for name in curves}
    with (folder / "runs.csv").open("a", encoding="utf-8") as table:
        runs.to_csv(table, index=False, header=False)
    np.savez_compressed(folder / "curves.npz", **joined)
    addition = made_here() | effort(runs, "variant")
    about = {**found.about, "runs": found.about["runs"] | addition["runs"]}
    _seal(folder, about | {"additions": [*found.about.get("additions", []), addition]})
    return folder


def effort(runs: pd.DataFrame, part: str) -> dict[str, Any]:
    """How many runs each part has, which a column tells, and how long all took."""
    counts = runs[part].value_counts(sort=False).to_dict()
    return {"runs": counts, "hours": float(runs.seconds.sum() / 3600)}


def _fixed(folder: Path) -> dict[str, Any]:
    """When the thresholds were fixed, as what was published before says it; else nothing."""
    try:
        return {"fixed": json.loads((folder / "about.json").read_text("utf-8"))["fixed"]}
    except (OSError, ValueError, LookupError):
        return {}


def _row_beside(
    found: Published, e: Experiment, one: RunSummary, part: str, header: list[str]
) -> dict[str, Any]:
    """The row of a further run, with how it went wrong beside its published frozen arm."""
    arm = frozen_arm(e)
    if e in found.rows:
        raise Unpublishable(f"{e} is published already, in the part {found.variants[e]!r}")
    if arm not in found.rows:
        raise Unpublishable(f"the frozen arm of {e} is not published, so it has nothing beside it")
    made = row(one)
    other = {name for name in made.keys() - set(header) if made[name] != OLDER.get(name)}
    if other:
        raise Unpublishable(f"{e} has another {min(other)}, for which runs.csv has no column")
    ratio = made["training_cost"] / found.rows[arm]["training_cost"]
    (wrong,) = went_wrong(pd.DataFrame([made | {"cost_ratio": ratio}]))
    mode = failure_mode(one, wrong, found.summaries[arm].states)
    return made | {"variant": part, "key": summary_key(e)} | mode


def _below(first: Column, second: Column) -> Column:
    """Two columns of `_curves`, one below the other, padded with nan to one length."""
    length = max(first.shape[1], second.shape[1])
    padded = (
        np.pad(
            one,
            [(0, 0), (0, length - one.shape[1]), *[(0, 0)] * (one.ndim - 2)],
            constant_values=np.nan,
        )
        for one in (first, second)
    )
    return np.concatenate([*padded])


def failure_modes_of(summaries: Mapping[Experiment, RunSummary]) -> pd.DataFrame:
    """`FAILURE_MODE` of each run, in order; the frozen arms have none."""
    moved = [e for e in summaries if e.learner != "frozen"]
    modes = failure_modes(summaries)[FAILURE_MODE].to_dict("records")
    known = dict(zip(moved, modes, strict=True))
    none = {"ending": "", "wrong": "", "episode": pd.NA, "mechanism": ""}
    return pd.DataFrame([known.get(e, none) for e in summaries], columns=FAILURE_MODE)


def load() -> Published:
    """What is published.

    Raises:
        Damaged: nothing is there, or not all that was written and as it was written.
    """
    return _load(place())


@cache
def _load(folder: Path) -> Published:
    try:
        if not folder.is_dir() or not any(folder.iterdir()):
            kind = ", which is no folder" if folder.exists() and not folder.is_dir() else ""
            raise Damaged(f"nothing is published in {folder}{kind}; {_restore()}")
        return _read(folder)
    except Damaged:
        raise
    except Exception as error:  # whatever a damaged file may lead to, a RecursionError included
        why = shortened(f"{type(error).__name__}: {error}")
        raise Damaged(f"{folder} is damaged ({why}); {_restore()}") from error


def _read(folder: Path) -> Published:
    about = json.loads((folder / "about.json").read_text("utf-8"))
    if about["seal"] != seal_of(about) or about["files"] != sums(folder, FILES[:-1]):
        raise ValueError("a file is not the one that was written")
    runs = pd.read_csv(folder / "runs.csv", dtype=dict.fromkeys(WORDS, str))
    runs = runs.fillna(dict.fromkeys(WORDS, ""))
    if strange := {*runs} - {*COLUMNS}:
        raise ValueError(f"runs.csv has columns that are not known: {', '.join(sorted(strange))}")
    for name, known in WORDS.items():
        if unknown := set(runs[name]) - known:
            raise ValueError(f"no {name} is called {', '.join(sorted(unknown))}")
    rows = {
        experiment_of(one): {name: one.get(name, OLDER.get(name, np.nan)) for name in COLUMNS}
        for one in runs.to_dict("records")
    }
    with (folder / "curves.npz").open("rb") as whole, np.load(whole, allow_pickle=False) as file:
        curves = {name: file[name] for name in file.files}
    if {len(rows)} != {len(column) for column in curves.values()}:
        raise ValueError("runs.csv and curves.npz are not of the same runs")
    followed = thetas.load(folder)
    return Published(
        {e: _outline_of(one, curves, i, followed) for i, (e, one) in enumerate(rows.items())},
        {e: one["variant"] for e, one in rows.items()},
        rows,
        _timings(folder / "timings.csv"),
        about,
        search.from_lists(json.loads((folder / "searches.json").read_text("utf-8"))),
    )


def sums(folder: Path, files: Iterable[str]) -> dict[str, str]:
    """What tells that files belong together and are whole."""
    contents = {name: (folder / name).read_bytes() for name in files}
    return {name: sha256(content).hexdigest() for name, content in contents.items()}


def _seal(folder: Path, about: Mapping[str, Any]) -> None:
    """Write about.json, by which the other files and itself are known again."""
    whole = {**about, "files": sums(folder, FILES[:-1])}
    write_json(folder / "about.json", whole | {"seal": seal_of(whole)}, indent=1)
    _load.cache_clear()


def _curves(summaries: list[RunSummary]) -> dict[str, Column]:
    """Columns of all runs, padded with nan to one length; shape (runs, ...)."""
    return {
        "cost": _padded([one.episodes["cost"] for one in summaries]),
        "judged_after": _padded([one.evaluations["episode"] for one in summaries]),
        "judged_cost": _padded([one.evaluations["cost"] for one in summaries]),
        "judged_theta": _padded([one.evaluations["theta"] for one in summaries]),
        "states": _padded([one.states for one in summaries]),
    }


def _padded(columns: list[Column]) -> Column:
    longest = max(map(len, columns))
    result = np.full((len(columns), longest, *columns[0].shape[1:]), np.nan, np.float32)
    for into, column in zip(result, columns, strict=True):
        into[: len(column)] = column
    return result


def _outline_of(
    row: dict[str, Any],
    curves: Mapping[str, Column],
    i: int,
    followed: Mapping[int, Column],
) -> Outline:
    judged = np.isfinite(curves["judged_after"][i])
    experiment = asdict(experiment_of(row))
    episodes = {"cost": curves["cost"][i][: experiment["episodes"]]}
    if i in followed:
        episodes["theta"] = followed[i][: experiment["episodes"]]
    return Outline(
        experiment,
        episodes,
        {
            "episode": curves["judged_after"][i][judged].astype(int),
            "theta": curves["judged_theta"][i][judged],
            "cost": curves["judged_cost"][i][judged],
        },
        curves["states"][i][: experiment["steps"]],
        None,
        {"stopped": row["stopped"], "seconds": row["seconds"]},
    )


def _timed(timings: pd.DataFrame | None) -> dict[str, Any]:
    """What about.json says of times that were taken just now, on this machine; else nothing."""
    return {} if timings is None else {"timings": made_here()}


def _timings(path: Path) -> pd.DataFrame:
    """As they were written; no rows where no time was taken."""
    return pd.read_csv(path) if path.read_text("utf-8").strip() else pd.DataFrame()
