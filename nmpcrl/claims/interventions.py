"""RDES again without the slope that its network extrapolates: runs chosen before they are made.

`population_questions` asks whether RDES survives with theta held in the network ("extrapolation").
The runs that answer are those of RDES that were stopped, with noise that decays per episode: all of
layouts A to F, and all of the drawn layouts. Of these, the first `SAMPLE`, one in each layout in a
drawn order, were registered and made first; the others were registered when those were known.

**Arms.** "theta held" and "true slope", of `analysis.extrapolation`. "nudged" is the control: the
run as it was, with 1e-9 added to each number of theta_init. Learning is chaotic, and a run that was
chosen because it was stopped may live when it is repeated for no better reason than that.

**Measured.** Whether the run has all its episodes. The share that has is read by `rule.read`; its
interval beside that one draws layouts. **The slope is the cause** if the true slope is confirmed in
A to F and in the drawn layouts, and more runs live with it than nudged: in both, the interval of
the difference, over layouts, lies above 0. The question that was registered is decided by its own
border, of A to F alone.

**Expected.** Of the nudged runs 10 to 50 % live, with theta held 50 to 90 %, with the true slope at
least 90 %. Seen before: the two runs of Chapter 12 and three more, of which two lived with theta
held and all with the true slope.

**Price.** 23 s a run, 65 minutes of one core. If time ends, what is whole by then in the order of
`runs` is all there is; the order knows no result.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.extrapolation import watch
from nmpcrl.analysis.predictors import over_layouts
from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims import population_published, published
from nmpcrl.claims.extendable import Extendable
from nmpcrl.claims.thresholds import was_stopped
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.population_design import name_of

DRAW, SAMPLE = 41, 50  # the seed of the order; drawn layouts of which one run was made again first
NUDGE = 1e-9
ARMS = ("theta held", "true slope", "nudged")
HELD = Extendable(
    "interventions.json", "what takes its slope from RDES", "python -m nmpcrl.claims.interventions"
)


def runs() -> dict[str, Experiment]:
    """The stopped runs that are made again: those of A to F, the sample, the others."""
    six = _stopped(published.load().main)
    drawn = _stopped(population_published.load().main)
    sample = _shuffled(drawn.drop_duplicates("layout"))[:SAMPLE]
    others = _shuffled(drawn.drop(sample.index))
    chosen = {}
    for part, table in (("six", _shuffled(six)), ("drawn", sample), ("drawn", others)):
        for one in table.itertuples():
            place = name_of(one.layout) if part == "drawn" else one.layout
            chosen[f"{part} {place} {one.seed}"] = Experiment(
                "RDES", layout=one.layout, decay="episode", seed=int(one.seed)
            )
    return chosen


def _stopped(table: pd.DataFrame) -> pd.DataFrame:
    """The stopped runs of RDES whose noise decays per episode, by layout and seed."""
    stopped = table[was_stopped(table)].query("learner == 'RDES' and decay == 'episode'")
    return stopped.sort_values(["layout", "seed"])


def _shuffled(table: pd.DataFrame) -> pd.DataFrame:
    return table.iloc[np.random.default_rng(DRAW).permutation(len(table))]


def lived(experiment: Experiment, arm: str) -> int:
    """How many episodes a run has with one of `ARMS`; all of them if it is not stopped."""
    nudged = tuple(one + NUDGE for one in experiment.theta)
    if arm == "nudged":
        outcome = watch(replace(experiment, theta=nudged))
    else:
        outcome = watch(experiment, arm)
    return outcome.episodes - outcome.stopped


def make() -> None:
    """Make the runs that are not published yet, and publish each when it is there."""
    content = HELD.begun(runs={})
    for name, experiment in runs().items():
        if name not in content["runs"]:
            content["runs"][name] = {arm: lived(experiment, arm) for arm in ARMS}
            HELD.write({**content, "about": []})


def load() -> pd.DataFrame:
    """What is published, as `population.extrapolation` takes it, and the part of each run.

    Raises:
        Damaged: it is not there, or not what was written.
    """
    content: Mapping[str, Any] = HELD.content(HELD.path)
    rows = []
    for name, by_arm in content["runs"].items():
        part, layout, seed = name.split()
        one = {"part": part, "layout": layout, "seed": int(seed)}
        rows.append({**one, "intervention": "none", "stopped": True})
        for arm, episodes in by_arm.items():
            stopped = episodes < Experiment("RDES").episodes
            rows.append({**one, "intervention": arm, "stopped": stopped})
    return pd.DataFrame(rows)


def live(table: pd.DataFrame, arm: str, than: str = "none") -> Estimate:
    """The share of runs that live with an arm, minus that with another; interval over layouts.

    Args:
        table: of `load`, of one part.
        arm: one of `ARMS`.
        than: another; "none", with which no run lives, leaves the share itself.
    """
    runs = table.pivot(index=["layout", "seed"], columns="intervention", values="stopped")
    gained = runs[than].astype(int) - runs[arm].astype(int)
    by_layout = gained.groupby(level="layout")

    def share(gains: Any, counts: Any) -> Any:
        return gains.sum(axis=-1) / counts.sum(axis=-1)

    return over_layouts(share, by_layout.sum().to_numpy(), by_layout.size().to_numpy())


if __name__ == "__main__":
    make()
