"""`nmpcrl runs`: what is stored, as a table or as JSON."""

import json
from dataclasses import dataclass, fields
from math import isfinite
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import click

from nmpcrl.commands.fields import Conditions
from nmpcrl.commands.names import OTHER_CODE, say_of_trials
from nmpcrl.commands.tables import columns, counted, duration, size

if TYPE_CHECKING:
    from nmpcrl.study.records import Facts

SHOWN = ("learner", "layout", "decay", "seed", "episodes")  # fields in the table
MEASURED = ("run", "cost", "minutes", "size", "stopped")  # what else runs can be sorted by
NUMBERS = frozenset((4, 5, 6, 7, 8))  # columns of the table


@dataclass(frozen=True)
class Row:
    """A stored run, without its tables of numbers."""

    path: Path
    fields: dict[str, Any]
    facts: "Facts"
    bytes: int

    def value(self, column: str) -> Any:
        """What runs are sorted by."""
        measured = {
            "run": self.path.stem,
            "cost": self.facts["final_cost"],
            "minutes": self.facts["seconds"] / 60,
            "size": self.bytes,
            "stopped": self.facts["stopped"],
        }
        return measured[column] if column in measured else self.fields.get(column)

    def words(self) -> list[str]:
        """The line of the table."""
        from nmpcrl.study.geometry import short_name

        return [
            self.path.stem,
            *(short_name(str(self.fields[name])) for name in SHOWN),
            f"{self.facts['final_cost']:.1f}",
            f"{self.facts['seconds'] / 60:.1f}",
            size(self.bytes),
            shorten(self.facts["stopped"], 60, placeholder=" ..."),
        ]

    def json(self) -> dict[str, Any]:
        """The object of `--json`."""
        return {
            "run": self.path.stem,
            "path": str(self.path),
            "bytes": self.bytes,
            "experiment": self.fields,
            "facts": self.facts,
        }


@click.command(cls=Conditions)
@click.option(
    "--sort",
    metavar="COLUMN",
    default="run",
    show_default=True,
    help=f"Any field, or one of {', '.join(MEASURED)}.",
)
@click.option("--reverse", is_flag=True, help="Largest first.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs.")
def runs(sort: str, reverse: bool, as_json: bool, **conditions: Any) -> None:
    """List the stored runs, or only those that the options select.

    An option that is given twice selects runs with either value.

    With --json, each run is an object with its name `run`, its `path`, its size
    in `bytes`, the fields of its `experiment`, and its `facts`: how it stopped
    (`stopped`), its noise-free cost `final_cost`, which is the mean of the last
    three rollouts, `seconds`, the `solver`, and where it was trained. A
    number that is not finite is null. Runs of a `Trial` of your own are only counted.

    \b
    Example:
      nmpcrl runs --learner GES --layout A --sort cost
    """
    wanted = _wanted(conditions)
    _refuse_unknown(sort)
    from nmpcrl.study.provenance import is_accepted, locked_hash, warn_of_changes
    from nmpcrl.study.store import folder, stored

    rows = [
        Row(path, fields, facts, path.stat().st_size)
        for path, (fields, facts) in stored().items()
        if all(_plain(fields.get(name)) in values for name, values in wanted.items())
    ]
    rows.sort(key=lambda row: _order(row.value(sort)), reverse=reverse)
    if as_json:
        click.echo(json.dumps(_finite([row.json() for row in rows]), indent=1))
    elif rows:
        _print(rows, folder())
    elif wanted:
        click.echo(f"No run in {folder()} matches; `nmpcrl runs` lists all.")
    else:
        click.echo(f"No run is stored in {folder()}; `nmpcrl train` trains one.")
    others = [row for row in rows if not is_accepted(row.facts.get("sources", locked_hash()))]
    if others:
        count = counted(len(others), "run")
        click.echo(f"{count} of {OTHER_CODE}; the first is {others[0].path.stem}", err=True)
    warn_of_changes()
    say_of_trials("`nmpcrl.study.fetch` reads them, and they are not listed")


def _wanted(conditions: dict[str, Any]) -> dict[str, tuple[Any, ...]]:
    """The values that each field may have; what no experiment may have is refused."""
    from nmpcrl.study import Experiment

    given = {
        name: value if isinstance(value, tuple) else (value,)
        for name, value in conditions.items()
        if value is not None and value != ()
    }
    return {
        name: tuple(_plain(getattr(Experiment(**{name: value}), name)) for value in values)
        for name, values in given.items()
    }


def _refuse_unknown(column: str) -> None:
    from nmpcrl.study import Experiment

    known = [*MEASURED, *(one.name for one in fields(Experiment))]
    if column not in known:
        raise click.ClickException(f"sort = {column!r} must be one of {', '.join(known)}")


def _print(rows: list[Row], place: Path) -> None:
    """Print the table and its totals."""
    head = ["run", *SHOWN, "final cost", "minutes", "size", "stopped"]
    for line in columns([head, *(row.words() for row in rows)], NUMBERS):
        click.echo(line)
    whole, seconds = sum(row.bytes for row in rows), sum(row.facts["seconds"] for row in rows)
    count = counted(len(rows), "run")
    click.echo(f"{count}, {size(whole)}, {duration(seconds)} of one core, in {place}")


def _plain(value: Any) -> Any:
    """A value as JSON returns it, so that two can be compared."""
    return tuple(value) if isinstance(value, list) else value


def _order(value: Any) -> tuple[int, Any]:
    """Numbers by size, and what is not known last."""
    if value is None or value != value:
        return 1, 0
    return 0, tuple(value) if isinstance(value, list) else value


def _finite(value: Any) -> Any:
    """The same in what JSON has: it knows no infinity."""
    if isinstance(value, dict):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not isfinite(value) else value
