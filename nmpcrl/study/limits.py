"""The time that experiments take, and the limits of time and memory."""

import os
from collections.abc import Iterable

from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import LEARNERS, NETWORKS
from nmpcrl.study.refusal import ParameterError

HOURS = 24.0  # of one core; the whole study takes about 5
STEPS = 4_000_000  # of one run, whose tables then take about 4 GB of memory
SURE = "NMPCRL_YES"  # environment variable that lifts the limit of hours

# Measured with the published study and with single runs of 3 to 3000 episodes and N = 5 to 500.
START = 0.2  # [s] until the problem is set up
STEP = 15e-6  # [s] of a step without its solves
FIT = 60e-6  # [s] of a mini-batch
SEARCH = 250e-6  # [s] of a network's best action
NETWORK_STEP = 35e-6  # [s] of a network, at a step, besides
SOLVE = {"riccati": (12e-6, 4e-6)}  # [s] of a solve, and of each stage of its plan


def seconds_of(experiment: Experiment) -> float:
    """About how long one core takes to train and judge a run [s]."""
    e, entry = experiment, LEARNERS[experiment.learner]
    once, stage = SOLVE.get(e.solver, (0.0, 250e-6))
    each = STEP
    if entry.network:
        read = NETWORKS[e.network]
        each += NETWORK_STEP + FIT * read.fits + SEARCH * read.greedy
    solves, rollouts = entry.solves + e.values_actions, e.episodes // e.evaluate_every + 2
    steps = e.episodes * e.steps
    return START + steps * each + (steps * solves + rollouts * e.steps) * (once + stage * e.horizon)


def afford(experiments: Iterable[Experiment], *, sure: bool = False) -> None:
    """Refuse runs that take more than `HOURS` together, and a run of more than `STEPS` steps.

    `sure`, or `SURE` in the environment, allows any number of hours.
    """
    runs = tuple(dict.fromkeys(experiments))
    for e in runs:
        if e.episodes * e.steps > STEPS:
            raise ParameterError(
                f"episodes = {e.episodes} with steps = {e.steps} make a run of"
                f" {e.episodes * e.steps:,} steps; {STEPS:,} are allowed, which fill 4 GB of memory"
            )
    hours = sum(map(seconds_of, runs)) / 3600
    if hours > HOURS and not sure and os.environ.get(SURE, "0") in ("", "0"):
        longest = max(runs, key=seconds_of)
        raise ParameterError(
            f"{len(runs):,} run{'s' * (len(runs) > 1)} with up to episodes = {longest.episodes},"
            f" steps = {longest.steps} and horizon = {longest.horizon} would take about"
            f" {hours:,.0f} hours of one core; {HOURS:.0f} are allowed, and more with {SURE}=1 in"
            " the environment"
        )
