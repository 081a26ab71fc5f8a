"""The whole study as it was trained once, in `book/published`, small enough to go with the book.

- `runs.csv`: one row a run, `summary.row`, with the part of the study it belongs to and its key;
- `curves.npz`: what figures need of each, in the same order: training cost by episode, cost and
  theta of the rollouts without noise, and the states of the last one;
- `thetas.npz`: theta after every episode, of the runs that a reader can follow (see `thetas`);
- `verdicts.json`: what became of each claim;
- `timings.csv`: of `time_learners`, on which the verdicts on time rest;
- `about.json`: code, libraries and machine, and when the thresholds were fixed.
"""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import nmpcrl
from nmpcrl.analysis.summary import DEFAULTS, RunSummary, experiment_of, row
from nmpcrl.bench.learners import ratio
from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import thetas
from nmpcrl.claims.failure_modes import WELL, Ending, Failure, Mechanism, failure_modes
from nmpcrl.claims.prespecified import from_git
from nmpcrl.claims.rule import Outcome, Verdict
from nmpcrl.study import design
from nmpcrl.study.atomic import write_json
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.parameters import Refusal, shortened
from nmpcrl.study.provenance import EPOCHS, environment, hash_of, summary_key
from nmpcrl.study.records import Column

FILES = ("runs.csv", "curves.npz", thetas.FILE, "verdicts.json", "timings.csv", "about.json")
SEEDLESS = [one.name for one in fields(Experiment) if one.name != "seed"]  # what a cell shares
CELL = ("learner", "layout", "decay")  # of these, what a table of contradictions shows
# Columns of `failure_modes`, and what may be in them; the frozen arms have none.
WORDS = {
    "ending": {*Ending, ""},
    "wrong": {*Failure, ""},
    "mechanism": {*Mechanism, WELL, ""},
}
FAILURE_MODE = [*WORDS, "episode"]
MEASURES = ("final_cost", "training_cost")  # by which runs of another machine are judged
SLACK = 0.01  # of theta_init's cost, that they may be out of the published range
EXACT = 1e-6  # relative: the cost of theta_init, which no noise and no learning moves


RESTORE = (
    "`git checkout -- book/published` restores what came with the project,"
    " `nmpcrl study --publish` makes it anew"
)


class Damaged(Refusal):
    """What is published is not there, or not what was written."""


@dataclass(frozen=True, eq=False)
class Published:
    """The published study.

    Of a summary it holds episodes["cost"] and, of some (see `thetas`), ["theta"];
    evaluations["episode"], ["theta"] and ["cost"], states and the facts "stopped" and "seconds";
    single precision but for the summaries in `rows`.
    """

    summaries: Mapping[Experiment, RunSummary] = field(default_factory=dict)
    variants: Mapping[Experiment, str] = field(default_factory=dict)  # the part each belongs to
    rows: Mapping[Experiment, dict[str, Any]] = field(default_factory=dict)  # of `runs.csv`
    verdicts: tuple[Verdict, ...] = ()
    timings: pd.DataFrame = field(default_factory=pd.DataFrame)  # of `time_learners`
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def main(self) -> pd.DataFrame:
        """The rows of the main table."""
        parts = self.variants.items()
        return pd.DataFrame([self.rows[e] for e, part in parts if part == design.MAIN_TABLE])

    def verdict(self, claim: str) -> Verdict:
        """What became of a claim.

        Raises:
            KeyError: no verdict on it is published.
        """
        return {one.claim: one for one in self.verdicts}[claim]

    def ratio(self, solver: str, learner: str) -> Ratio:
        """Time of a learner's step over that of one of ES, as `bench.learners.ratio` has it."""
        return ratio(self.timings, solver, learner)


def place() -> Path:
    """The folder, or what the environment variable NMPCRL_PUBLISHED says."""
    beside = Path(nmpcrl.__file__).parent.parent / "book" / "published"
    return Path(os.environ.get("NMPCRL_PUBLISHED") or beside)


def publish(
    summaries: Mapping[Experiment, RunSummary],
    variants: Mapping[Experiment, str],
    verdicts: Sequence[Verdict],
    timings: pd.DataFrame | None = None,
) -> Path:
    """Write all files anew; the same content gives the same bytes, but for the date.

    Args:
        summaries: the runs.
        variants: the part of the study that each belongs to.
        verdicts: on the claims.
        timings: of `time_learners`, if there were any taken.

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
    _write(folder, verdicts, pd.DataFrame() if timings is None else timings)
    about = {
        "date": datetime.now(UTC).date().isoformat(),
        "epochs": EPOCHS,
        "versions": environment(),
        "machine": fingerprint(),
        "runs": runs.variant.value_counts(sort=False).to_dict(),
        "hours": float(runs.seconds.sum() / 3600),
    }
    _seal(folder, about)
    return folder


def republish(verdicts: Iterable[Verdict], timings: pd.DataFrame | None = None) -> Path:
    """Put these in the place of the published verdicts on the same claims; the runs stay.

    Args:
        verdicts: on claims of which a verdict is published.
        timings: of `time_learners`, in the place of the published ones, if they were taken anew.

    Returns:
        Where they are.

    Raises:
        Damaged: what is published is not what `publish` wrote.
        KeyError: there is no published verdict on a claim.
    """
    found, folder = load(), place()
    kept = {verdict.claim: verdict for verdict in found.verdicts}
    for verdict in verdicts:
        if verdict.claim not in kept:
            raise KeyError(f"no verdict on {verdict.claim} is published in {folder}")
        kept[verdict.claim] = verdict
    _write(folder, kept.values(), found.timings if timings is None else timings)
    _seal(folder, found.about)
    return folder


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
            raise Damaged(f"nothing is published in {folder}{kind}; {RESTORE}")
        return _read(folder)
    except Damaged:
        raise
    except Exception as error:  # whatever a damaged file may lead to, a RecursionError included
        why = shortened(f"{type(error).__name__}: {error}")
        raise Damaged(f"{folder} is damaged ({why}); {RESTORE}") from error


def _read(folder: Path) -> Published:
    about = json.loads((folder / "about.json").read_text())
    if about["seal"] != _sealed(about) or about["files"] != _sums(folder):
        raise ValueError("a file is not the one that was written")
    runs = pd.read_csv(folder / "runs.csv", dtype=dict.fromkeys(WORDS, str))
    runs = runs.fillna(dict.fromkeys(WORDS, ""))
    for name, known in WORDS.items():
        if unknown := set(runs[name]) - known:
            raise ValueError(f"no {name} is called {', '.join(sorted(unknown))}")
    rows = {experiment_of(one): DEFAULTS | one for one in runs.to_dict("records")}
    with (folder / "curves.npz").open("rb") as whole, np.load(whole, allow_pickle=False) as file:
        curves = {name: file[name] for name in file.files}
    if {len(rows)} != {len(column) for column in curves.values()}:
        raise ValueError("runs.csv and curves.npz are not of the same runs")
    followed = thetas.load(folder)
    verdicts = json.loads((folder / "verdicts.json").read_text())
    return Published(
        {e: _summary_of(one, curves, i, followed) for i, (e, one) in enumerate(rows.items())},
        {e: one["variant"] for e, one in rows.items()},
        rows,
        tuple(_verdict(one) for one in verdicts),
        _timings(folder / "timings.csv"),
        about,
    )


def compare(fresh: Mapping[Experiment, RunSummary], published: Published) -> pd.DataFrame:
    """Where runs that were trained here contradict the published ones: one row each, none if none.

    Where code, versions and machine are the same, every run must be the same to the last bit.
    Elsewhere rounding differs, and learning may make much of that. So theta_init's cost must agree
    to `EXACT`, and of the runs of a learner, layout and reading of the decay at least half must lie
    within the range of the published ones, widened on both sides by itself and by `SLACK`.
    """
    rows = {e: row(one) for e, one in fresh.items() if e in published.rows}
    exact = comparable(rows, published)
    wrong = [unequal(e, rows[e], published.rows[e]) for e in sorted(exact, key=str)]
    others = {e: one for e, one in rows.items() if e not in exact}
    wrong += _out_of_range(others, published)
    names = [*CELL, "seed", "what", "here", "published"]
    return pd.DataFrame([one for one in wrong if one], columns=names)


def comparable(runs: Iterable[Experiment], published: Published) -> set[Experiment]:
    """Those of which code, versions and machine are the ones of the published runs."""
    made = {"machine": fingerprint(), "versions": environment()}
    if any(published.about.get(name) != value for name, value in made.items()):
        return set()
    known = published.rows
    return {e for e in runs if e in known and known[e]["key"] == summary_key(e)}


def unequal(
    e: Experiment, here: Mapping[str, Any], there: Mapping[str, Any]
) -> tuple[Any, ...] | None:
    """The first number in which two runs differ that should be the same."""
    compared = [*MEASURES, "initial_cost", *(f"theta_{i}" for i in range(len(e.theta)))]
    for name in compared:
        if here[name] != there[name]:
            return e.learner, e.layout, e.decay, e.seed, name, here[name], str(there[name])
    return None


def _out_of_range(
    rows: Mapping[Experiment, dict[str, Any]], published: Published
) -> list[tuple[Any, ...]]:
    """The rule for runs of another machine; see `compare`."""
    wrong: list[tuple[Any, ...]] = []
    if not rows:
        return wrong
    known = pd.DataFrame([published.rows[e] for e in published.rows])
    cells = dict(list(known.groupby(SEEDLESS)))
    for named, group in pd.DataFrame(list(rows.values())).groupby(SEEDLESS):
        there, cell = cells[named], tuple(group[list(CELL)].iloc[0])
        start = float(there.initial_cost.iloc[0])
        for seed, here in zip(group.seed, group.initial_cost, strict=True):
            if abs(here / start - 1) > EXACT:
                wrong.append((*cell, seed, "initial_cost", here, str(start)))
        for name in MEASURES:
            low, high = _widened(there[name].to_numpy(float), SLACK * start)
            outside = ~group[name].between(low, high)
            if outside.mean() > 0.5:
                middle = float(group[name].median())
                wrong.append((*cell, "all", name, middle, f"{low:.1f} to {high:.1f}"))
    return wrong


def _widened(values: Column, slack: float) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return -np.inf, np.inf
    width = float(np.ptp(finite)) + slack
    most = np.inf if finite.size < values.size else float(finite.max()) + width
    return float(finite.min()) - width, most


def _sums(folder: Path) -> dict[str, str]:
    """What tells that the files belong together and are whole."""
    contents = {name: (folder / name).read_bytes() for name in FILES[:-1]}
    return {name: sha256(content).hexdigest() for name, content in contents.items()}


def _seal(folder: Path, about: Mapping[str, Any]) -> None:
    """Write about.json, by which the other files and itself are known again.

    It says when the thresholds were fixed, too: what git says, else what was known.
    """
    known = from_git()
    since = {"fixed": known.facts} if known else {}
    sealed = {**about, **since, "files": _sums(folder)}
    write_json(folder / "about.json", sealed | {"seal": _sealed(sealed)}, indent=1)
    _load.cache_clear()


def _sealed(about: Mapping[str, Any]) -> str:
    """What tells that about.json is whole."""
    return hash_of({name: value for name, value in about.items() if name != "seal"})


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


def _summary_of(
    summary: dict[str, Any],
    curves: Mapping[str, Column],
    i: int,
    followed: Mapping[int, Column],
) -> RunSummary:
    judged = np.isfinite(curves["judged_after"][i])
    experiment = asdict(experiment_of(summary))
    episodes = {"cost": curves["cost"][i][: experiment["episodes"]]}
    if i in followed:
        episodes["theta"] = followed[i][: experiment["episodes"]]
    return RunSummary(
        experiment,
        episodes,
        {
            "episode": curves["judged_after"][i][judged].astype(int),
            "theta": curves["judged_theta"][i][judged],
            "cost": curves["judged_cost"][i][judged],
        },
        curves["states"][i][: experiment["steps"]],
        np.empty((0, 0)),
        {"stopped": summary["stopped"], "seconds": summary["seconds"]},
    )


def _write(folder: Path, verdicts: Iterable[Verdict], timings: pd.DataFrame) -> None:
    """The files that need no run."""
    write_json(folder / "verdicts.json", [asdict(verdict) for verdict in verdicts], indent=1)
    timings.to_csv(folder / "timings.csv", index=False)


def _timings(path: Path) -> pd.DataFrame:
    """As they were written; no rows where no time was taken."""
    return pd.read_csv(path) if path.read_text().strip() else pd.DataFrame()


def _verdict(stored: dict[str, Any]) -> Verdict:
    """A verdict as JSON has it, with its tuples again."""
    interval = stored["interval"] and tuple(stored["interval"])
    counts = {name: tuple(pair) for name, pair in stored["counts"].items()}
    parts: dict[str, Any] = {
        name: {part: Outcome(outcome) for part, outcome in stored[name].items()}
        for name in ("by_layout", "by_decay")
    }
    parts |= {"outcome": Outcome(stored["outcome"]), "interval": interval, "counts": counts}
    parts |= {name: tuple(stored.get(name, ())) for name in ("as_claimed", "reverse")}
    return Verdict(**stored | parts)
