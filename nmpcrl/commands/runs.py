"""`nmpcrl runs`: the stored runs as a table."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from textwrap import shorten
from typing import Any

import click

COLUMNS = ("run", "learner", "layout", "decay", "seed", "episodes",
           "cost", "minutes", "kB", "stopped")  # fmt: skip
LISTED = 5  # names in a refusal


@click.command()
@click.argument("name", default="")
@click.option("--sort", type=click.Choice(COLUMNS), default="run")
@click.option("--reverse", is_flag=True, help="Largest first.")
def runs(name: str, sort: str, reverse: bool) -> None:
    """List the stored runs, or those whose names begin with NAME.

    NAME may have the wildcards *, ? and [...]. The column cost has the noise-free
    cost, which is the mean of the last three rollouts.

    Runs of a `Trial` are not listed. In Python, `nmpcrl.study.stored()` has all
    fields and facts of each run.

    \b
    Example:
      nmpcrl runs GES-A --sort cost
      nmpcrl runs "*-episode-seed0"
    """
    from nmpcrl.study.files import folder
    from nmpcrl.study.lock import is_accepted, warn_of_changes
    from nmpcrl.study.store import stored

    found = {path: about for path, about in stored().items() if begins(path, name)}
    if found:
        import pandas as pd

        table = pd.DataFrame([_row(path, *one) for path, one in found.items()])
        ordered = table.sort_values(sort, ascending=not reverse, kind="stable")
        click.echo(ordered.to_string(index=False, float_format="{:.1f}".format))
    else:
        click.echo(f"no run {name!r} is stored in {folder()}; `nmpcrl train` trains one")
    others = sum(not is_accepted(one.facts.get("sources")) for one in found.values())
    if others:
        click.echo(f"{others} of them are of other code, whose numbers may differ", err=True)
    warn_of_changes()


def begins(path: Path, name: str) -> bool:
    """Whether the name of a file begins with a name, which may have wildcards."""
    return fnmatchcase(path.stem, f"{name}*")


def costs_of(records: Any) -> str:
    """The costs without noise of a run, as `train` and `show` print them."""
    from nmpcrl.analysis import metrics
    from nmpcrl.study.records import LAST

    before, after = metrics.initial_cost(records), metrics.final_cost(records)
    return (
        f"noise-free cost {after:.1f} (mean of the last {LAST} rollouts); theta_init's was"
        f" {before:.1f}"
    )


def stored_run(name: str) -> Path:
    """The file of a stored run, by its path, its name, or the beginning of no other run's name."""
    from nmpcrl.study.files import folder

    if name.endswith(".npz") and Path(name).is_file():
        return Path(name)
    known = sorted(folder().glob("*.npz"))
    found = [path for path in known if path.stem == name]
    found = found or [path for path in known if begins(path, name)]
    if len(found) == 1:
        return found[0]
    names = [path.stem for path in found or known]
    listed = ", ".join(names[:LISTED]) + ", ..." * (len(names) > LISTED)
    begin = f"{len(found)} runs begin" if found else "no run begins"
    raise click.ClickException(f"in {folder()} {begin} with {name!r}; stored: {listed or 'none'}")


def _row(path: Path, fields: Mapping[str, Any], facts: Mapping[str, Any]) -> dict[str, Any]:
    """A run by column."""
    from nmpcrl.study import Experiment
    from nmpcrl.study.geometry import short_name

    e = Experiment(**fields)
    cost, minutes, size = facts["final_cost"], facts["seconds"] / 60, path.stat().st_size / 1000
    stopped = shorten(facts["stopped"], 60, placeholder=" ...")
    named = (path.stem, e.learner, short_name(e.layout), e.decay, e.seed, e.episodes)
    return dict(zip(COLUMNS, (*named, cost, minutes, size, stopped), strict=True))
