"""The command `nmpcrl`: train a run or the whole study, list and judge what is stored."""

from contextlib import nullcontext
from pathlib import Path
from textwrap import shorten
from typing import Any

import click
import numpy as np
import pandas as pd
from tqdm import tqdm

from nmpcrl import __version__
from nmpcrl.analysis import metrics
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.study import DamagedRecords, Experiment, ParameterError, Records, fetch, paper
from nmpcrl.study.records import StepStatus, Stopped
from nmpcrl.study.setup import DECAYS, LEARNERS
from nmpcrl.study.store import folder, path_of, stored

HELP = {"help_option_names": ["-h", "--help"]}
RELOCKED = 60  # runs that are trained afresh before the code is locked anew


@click.group(context_settings=HELP)
@click.version_option(__version__, message="nmpcrl %(version)s")
def main() -> None:
    """Reinforcement learning on top of nonlinear MPC: one paper, reproduced."""


@main.command()
@click.option("--learner", default="ES", show_default=True, help=f"One of {', '.join(LEARNERS)}.")
@click.option("--seed", default=0, show_default=True, help="Of the noise and the network.")
@click.option("--episodes", default=paper.EPISODES, show_default=True)
@click.option("--layout", default="A", show_default=True, help="Of the obstacles.")
@click.option(
    "--decay", default="step", show_default=True, help=f"Exploration, per {' or '.join(DECAYS)}."
)
@click.option("--alpha", default=paper.ALPHA, show_default=True, help="Step size of theta.")
@click.option("--beta", default=paper.BETA, show_default=True, help="Step size of w.")
@click.option(
    "--solver", default="riccati", show_default=True, help=f"One of {', '.join(SOLVERS)}."
)
@click.option("--literal", is_flag=True, help="Algorithm 1 literally: do not wait for the network.")
def train(literal: bool, **fields: Any) -> None:
    """Train one run and store it; a stored one is read."""
    try:
        experiment = Experiment(gated=not literal, **fields)
    except ParameterError as error:
        raise click.ClickException(str(error)) from None
    with tqdm(total=experiment.episodes, unit="ep", desc=experiment.learner) as bar:

        def on_episode(done: int, cost: float) -> None:
            bar.set_postfix_str(f"cost {cost:.0f}", refresh=False)
            bar.update(done - bar.n)

        records = fetch(experiment, on_episode=on_episode)
        bar.update(
            experiment.episodes - bar.n if records.facts["stopped"] == Stopped.FINISHED else 0
        )
    click.echo(f"{path_of(experiment)}: {records.facts['stopped']}")
    click.echo(_verdict(records))


@main.command()
def runs() -> None:
    """List the stored runs."""
    rows = [
        {
            "run": path.stem,
            "learner": fields["learner"],
            "layout": fields["layout"],
            "decay": fields["decay"],
            "seed": fields["seed"],
            "episodes": fields["episodes"],
            "final cost": f"{facts['final_cost']:.1f}",
            "minutes": f"{facts['seconds'] / 60:.1f}",
            "stopped": shorten(facts["stopped"], 60, placeholder=" ..."),
        }
        for path, (fields, facts) in stored().items()
    ]
    if rows:
        click.echo(pd.DataFrame(rows).to_string(index=False))
    else:
        click.echo(f"No run is stored in {folder()}; `nmpcrl train` makes one.")


@main.command()
@click.argument("run")
def evaluate(run: str) -> None:
    """Print the figures of the last noise-free rollout of RUN, a name that `nmpcrl runs` lists."""
    path = Path(run) if run.endswith(".npz") else folder() / f"{run}.npz"
    try:
        records = Records.load(path)
    except FileNotFoundError:
        names = ", ".join(p.stem for p in stored()) or "none"
        raise click.ClickException(f"no run {run!r} in {folder()}; there are: {names}") from None
    except DamagedRecords as error:
        raise click.ClickException(str(error)) from None
    click.echo(_verdict(records))
    for name, value in _figures(records).items():
        click.echo(f"{name:38} {value}")


@main.command()
@click.option("--full", "length", flag_value="full", default=True, help="Minutes; the default.")
@click.option("--short", "length", flag_value="short", help="As short as the book needs it.")
@click.option("--smoke", "length", flag_value="smoke", help="To see that it works.")
@click.option("--again", is_flag=True, help="Measure even if there is a benchmark of this code.")
@click.option("--publish", is_flag=True, help="Only time the learners; publish C3 and C4 anew.")
def bench(length: str, again: bool, publish: bool) -> None:
    """Measure how long solves, steps and runs take, and hold it against what is to be reached."""
    if publish:
        _publish_timing()
        return
    from nmpcrl.bench import suite, targets  # nothing else here needs them

    measured = suite.measure(length) if again else suite.read_or_measure(length)
    rows = targets.rows(measured)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        click.echo(" | ".join(map(str.ljust, row, widths)))
    about = measured["about"]
    took = f"{about['length']}, {about['date']}, {about['seconds']:.0f} s"
    click.echo(f"{suite.path()}: {took}; other programs had {about['others']:.0%} of the cores")


@main.command()
@click.option("--part", "parts", multiple=True, help="Only this part: main, controls or a variant.")
@click.option("--workers", type=click.IntRange(1), help="Processes; as many as cores by default.")
@click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster that trains instead.")
@click.option("--dry-run", is_flag=True, help="Only say how much is to be done.")
@click.option("--table", type=click.Path(dir_okay=False, path_type=Path), help="Episodes, as CSV.")
@click.option("--publish", is_flag=True, help="Judge what was asked for and write book/published.")
def study(
    parts: tuple[str, ...],
    workers: int | None,
    scheduler: str | None,
    dry_run: bool,
    table: Path | None,
    publish: bool,
) -> None:
    """Train whatever is missing of the study; interrupt it and start it again as you like."""
    from nmpcrl.analysis import summaries, summary
    from nmpcrl.claims.publish import publish_study
    from nmpcrl.study import cluster, design

    chosen = design.whole_study()
    unknown = set(parts) - set(chosen.values())
    if unknown:
        known = ", ".join(dict.fromkeys(chosen.values()))
        raise click.ClickException(f"there is no part {min(unknown)!r}; there are {known}")
    chosen = {e: name for e, name in chosen.items() if not parts or name in parts}
    missing = [e for e in chosen if not summaries.is_stored(e)]
    hours = sum(map(summaries.seconds_of, missing)) / 3600
    click.echo(
        f"{len(chosen) - len(missing)} of {len(chosen)} runs are stored in {summaries.folder()};"
        f" the others take about {hours:.1f} hours of one core"
    )
    if dry_run:
        return
    try:
        with cluster.executor(scheduler) if scheduler else nullcontext() as executor:
            found = summaries.fetch_summaries(
                chosen, executor=executor, workers=workers, strict=publish
            )
    except (cluster.NoCluster, summaries.Failed) as error:
        raise click.ClickException(str(error)) from None
    if table:
        frames = [summary.tidy([one]).assign(variant=chosen[e]) for e, one in found.items()]
        pd.concat(frames).to_csv(table, index=False, float_format="%.7g")
        click.echo(f"{table}: {table.stat().st_size / 1e6:.0f} MB")
    if publish:
        click.echo(f"{publish_study(found, chosen)}: published")
    if len(found) < len(chosen):
        raise SystemExit(1)  # what failed has been said


@main.command()
@click.option("--sample", type=click.IntRange(0), default=0, help="Train so many runs for it.")
@click.option("--relock", is_flag=True, help="Show that an edit changed no bit, and lock the code.")
@click.option("--workers", type=click.IntRange(1), help="Processes; as many as cores by default.")
def verify(sample: int, relock: bool, workers: int | None) -> None:
    """Hold the runs that were trained here against the published ones."""
    from nmpcrl.analysis import summaries
    from nmpcrl.claims import published, verification

    try:
        known = published.load()
    except published.Damaged as error:
        raise click.ClickException(str(error)) from None
    if not known.rows:
        raise click.ClickException(f"nothing is published in {published.place()}")
    if relock:
        try:
            done = verification.relock(known, sample or RELOCKED, workers=workers)
        except verification.CannotRelock as error:
            raise click.ClickException(str(error)) from None
        click.echo(
            f"{done.published + done.stored} fresh runs have the same bits, {done.published} as the"
            f" published ones and {done.stored} as those made here before: {done.lock} is written"
        )
        return
    drawn = set(verification.sample(known, sample)) if sample else set()
    own = [e for e in known.rows if e in drawn or summaries.path_of(e).exists()]
    if not own:
        raise click.ClickException(
            "no run of the study was trained here; --sample 5 trains five for this"
        )
    found = summaries.fetch_summaries(own, workers=workers)
    wrong = published.compare(found, known)
    exact = published.comparable(found, known)
    click.echo(
        f"{len(found)} runs: {len(exact)} held against the published ones bit for bit,"
        f" {len(found) - len(exact)} by distribution, {len(wrong)} contradictions"
    )
    if len(wrong):
        click.echo(wrong.to_string(index=False))
        raise SystemExit(1)


def _publish_timing() -> None:
    """Publish the verdicts on time anew, if the machine lets them be decided."""
    from nmpcrl.claims.publish import publish_timing
    from nmpcrl.claims.rule import UNDECIDABLE

    judged = publish_timing()
    for verdict in judged:
        click.echo(f"{verdict.claim}: {verdict.outcome}. {verdict.evidence}")
    if UNDECIDABLE in {verdict.outcome for verdict in judged}:
        raise click.ClickException("nothing is published: try again when the machine is idle")


def _verdict(records: Records) -> str:
    """The noise-free cost before and after, in a sentence."""
    before, after = metrics.initial_cost(records), metrics.final_cost(records)
    change = f"{abs(1 - after / before):.1%} {'less' if after <= before else 'more'}"
    return f"noise-free cost {after:.1f}, {change} than the {before:.1f} of theta_init"


def _figures(records: Records) -> dict[str, str]:
    """What a rollout without noise shows, ready to print."""
    task = paper.task(records.experiment["layout"])
    states, actions = metrics.final_rollout(records)
    overlap = task.overlap(states).max(axis=-1)
    theta = ", ".join(f"{value:.4g}" for value in records.evaluations["theta"][-1])
    failed = records.steps["status"] == StepStatus.FAILED
    return {
        "cost of the last rollout": f"{records.evaluations['cost'][-1]:.1f}",
        "steps": f"{np.isfinite(states[:, 0]).sum()} of {len(states)}",
        "distance to the target at the end": f"{task.distance(states[-1]):.3f}",
        "largest overlap Xi (above 0: inside)": f"{np.nanmax(overlap):.4f}",
        "states inside an obstacle": f"{metrics.obstacle_violations(states, task).size}",
        "largest speed and turn rate": " and ".join(
            f"{value:.3f}" for value in np.nanmax(np.abs(actions), axis=0)
        ),
        "steps of training with a failed solve": f"{failed.sum()}",
        "steps with alpha ||phi||^2 above 2": f"{metrics.overshooting(records):.2%}",
        "theta": theta,
    }


if __name__ == "__main__":
    main()
