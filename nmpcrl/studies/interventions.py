"""RDES again without the slope that its network extrapolates: runs chosen before they are made.

The question "extrapolation" of `population` asks whether RDES survives with theta held in the
network. The runs that answer are all runs of RDES that were stopped, with noise that decays per
episode. Of the drawn layouts, the first `SAMPLE` runs, one in each layout in a drawn order, were
registered and made first; the others were registered when the results of the first were known.

Arms are "theta held" and "true slope", of `analysis.extrapolation`, and as a control "nudged", with
1e-9 added to each number of theta_init: learning is chaotic, and a run that was chosen because it
was stopped may live when it is repeated for no better reason than that. A run lives that has all
its episodes. **The slope is the cause** if the true slope is confirmed in A to F and in the drawn
layouts, and in both the interval of the difference to nudged, over layouts, lies above 0.

**Expected.** Of the nudged runs 10 to 50 % live, with theta held 50 to 90 %, with the true slope at
least 90 %. Five runs were seen before: two lived with theta held, all with the true slope.
"""

from functools import cache, partial

import numpy as np
import pandas as pd

from nmpcrl.analysis.extrapolation import watch
from nmpcrl.analysis.statistics import Estimate, over_layouts
from nmpcrl.claims import published
from nmpcrl.claims.thresholds import was_stopped
from nmpcrl.claims.verdict import REPRODUCED
from nmpcrl.studies import population
from nmpcrl.studies.investigation import Answer, Investigation, Part, Question, Row, share
from nmpcrl.study import paper
from nmpcrl.study.drawn import LAYOUTS, name_of
from nmpcrl.study.experiment import Experiment

DRAW, SAMPLE = 41, 50  # the seed of the order; drawn layouts of which one run was made again first
NUDGE = 1e-9
ARMS = {  # the intervention, and the number added to theta_init
    "theta held": ("theta held", 0.0),
    "true slope": ("true slope", 0.0),
    "nudged": ("none", NUDGE),
}


@cache
def stopped(part: str) -> list[tuple[str, int]]:
    """Layout and k of each stopped run, in the order in which they are made again."""
    if part == "six":
        six = _shuffled(_stopped(published.load().main.runs))
        return [*zip(six.layout, six.seed.tolist(), strict=True)]
    drawn = _stopped(population.load().main)
    sample = _shuffled(drawn.drop_duplicates("layout"))[:SAMPLE]
    others = _shuffled(drawn.drop(sample.index))
    runs = pd.concat([sample, others])
    places = zip(map(name_of, runs.layout), runs.seed.tolist(), strict=True)
    return [(place, seed - population.seed_of(place, 0)) for place, seed in places]


def _stopped(table: pd.DataFrame) -> pd.DataFrame:
    """The stopped runs of RDES whose noise decays per episode, by layout and seed."""
    stopped = table[was_stopped(table)].query("learner == 'RDES' and decay == 'episode'")
    return stopped.sort_values(["layout", "seed"])


def _shuffled(table: pd.DataFrame) -> pd.DataFrame:
    return table.iloc[np.random.default_rng(DRAW).permutation(len(table))]


def again(setting: tuple[str, float], place: str, episodes: int, seed: int) -> Row:
    """The number of complete episodes of a run with an intervention."""
    intervention, nudge = setting
    layout, theta = LAYOUTS.get(place, place), tuple(one + nudge for one in paper.THETA_INIT)
    run = Experiment("RDES", seed, episodes, layout, decay="episode", theta=theta)
    outcome = watch(run, intervention)
    return {"episodes": outcome.episodes - outcome.stopped}


def ends(table: pd.DataFrame) -> pd.DataFrame:
    """Columns part, layout, seed, intervention and stopped: without one ("none") and with each."""
    rows: list[Row] = []
    for (part, place, k), runs in table.groupby(["part", "place", "k"], sort=False):
        one = {"part": part, "layout": place, "seed": INTERVENTIONS.seed(place, k)}
        stopped = dict(zip(runs.arm, runs.episodes < paper.EPISODES, strict=True))
        for arm, ended in {"none": True, **stopped}.items():
            rows.append({**one, "intervention": arm, "stopped": bool(ended)})
    return pd.DataFrame(rows)


def survival(runs: pd.DataFrame, arm: str = "theta held") -> Answer:
    """The answer of layouts A to F to the question "extrapolation", for any arm; runs of `ends`."""
    there = runs[(runs.part == "six") & (runs.intervention == arm)]
    return share(~there.stopped, f"survive, {arm}")


def live(runs: pd.DataFrame, arm: str, than: str = "none") -> Estimate:
    """The share of runs that live with an arm, minus the share with another; interval over layouts.

    The runs are those of one part of `ends`; with "none" none lives.
    """
    by = runs.pivot(index=["layout", "seed"], columns="intervention", values="stopped").astype(int)
    gained = (by[than] - by[arm]).groupby(level="layout").agg(["sum", "size"]).to_numpy().T
    return over_layouts(lambda gains, counts: gains.sum(axis=-1) / counts.sum(axis=-1), *gained)


INTERVENTIONS = Investigation(
    name="interventions",
    parts={
        part: Part(again, ARMS, (), paper.EPISODES, at=partial(stopped, part))
        for part in ("six", "drawn")
    },
    questions=(
        Question("extrapolation",
                 "Does RDES survive if the network is asked with theta of the start of the episode,"
                 " and nothing else is changed?",
                 REPRODUCED, survival),
    ),
    seed=lambda place, k: population.seed_of(place, k) if place in LAYOUTS else k,
    evidence=ends,
    registered="a02ad04",  # the stopped runs in drawn layouts beyond the sample: f8a3b4d
)  # fmt: skip
