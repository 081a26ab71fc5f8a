"""What experiments will take, and where that is too much to begin without being sure."""

import os
from collections.abc import Iterable
from dataclasses import dataclass

from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import LEARNERS, NETWORKS
from nmpcrl.study.parameters import ParameterError, Refusal
from nmpcrl.study.provenance import environment

HOURS = 24.0  # of one core, that are begun without asking; the whole study takes about 5
MEMORY = 4e9  # bytes that a run may take
SURE = "NMPCRL_YES"  # set in the environment by who is sure

# Measured with the published study and with single runs of 3 to 3000 episodes and N = 5 to 500.
BASE = 0.45e9  # bytes of a process that trains: the libraries
ROW = 900  # bytes a step, while the table of steps is copied
NETWORK_ROW = 250  # bytes a step: a network's examples, whose buffer doubles
ROLLOUT_ROW = 120  # bytes a step of a rollout without noise
START = 0.2  # [s] until the problem is set up
STEP = 15e-6  # [s]; all of a step but its solves
FIT = 150e-6  # [s]
SEARCH = 250e-6  # [s]; of a network's best action
NETWORK_STEP = 100e-6  # [s]; what a network does at a step besides
SOLVE = {"riccati": (20e-6, 6e-6)}  # [s]; of a solve, and of each stage of its plan
SLOW_SOLVE = (0.0, 250e-6)  # of every other solver


@dataclass(frozen=True)
class Estimate:
    """About what some runs take if none of them is stored."""

    runs: int = 0
    seconds: float = 0.0  # of one core
    memory: float = 0.0  # bytes of the process that trains the largest run
    longest: Experiment | None = None
    largest: Experiment | None = None

    def refuse(
        self, *, sure: bool | None = None, lift: str = f"{SURE}=1 in the environment"
    ) -> None:
        """Refuse what takes too long, unless somebody is `sure`, and what no run may take.

        Args:
            sure: whether any time is all right; by default what `SURE` in the environment says.
            lift: how the reader says so, for the message.

        Raises:
            ParameterError: a run takes more than `MEMORY`, or all together more than `HOURS`.
        """
        if self.largest and self.memory > MEMORY:
            raise ParameterError(
                f"a run with {_size(self.largest)} takes about {self.memory / 1e9:.1f} GB of"
                f" memory; {MEMORY / 1e9:.0f} GB are allowed"
            )
        sure = os.environ.get(SURE, "") not in ("", "0") if sure is None else sure
        hours = self.seconds / 3600
        if self.longest and hours > HOURS and not sure:
            runs = "one run" if self.runs == 1 else f"{self.runs:,} runs, the longest"
            raise ParameterError(
                f"{runs} with {_size(self.longest)}, would take about {hours:,.0f} hours of one"
                f" core; {HOURS:.0f} are allowed, and more with {lift}"
            )


def estimate(experiments: Iterable[Experiment]) -> Estimate:
    """What these runs take; one that is named twice counts once."""
    runs = tuple(dict.fromkeys(experiments))
    if not runs:
        return Estimate()
    longest, largest = max(runs, key=seconds_of), max(runs, key=memory_of)
    return Estimate(
        runs=len(runs),
        seconds=sum(map(seconds_of, runs)),
        memory=memory_of(largest),
        longest=longest,
        largest=largest,
    )


def seconds_of(experiment: Experiment) -> float:
    """About how long one core takes [s]."""
    e = experiment
    once, stage = SOLVE.get(e.solver, SLOW_SOLVE)
    rollouts = e.episodes // e.evaluate_every + 2
    each = STEP
    entry = LEARNERS[e.learner]
    if entry.network:
        read = NETWORKS[e.network]
        each += NETWORK_STEP + FIT * read.fits + SEARCH * read.greedy
    solves = entry.solves + e.values_actions
    steps = e.episodes * e.steps
    return START + steps * each + (steps * solves + rollouts * e.steps) * (once + stage * e.horizon)


def memory_of(experiment: Experiment) -> float:
    """About how many bytes the process takes that trains it."""
    e = experiment
    rollouts = e.episodes // e.evaluate_every + 2
    row = ROW + NETWORK_ROW * LEARNERS[e.learner].network
    return BASE + e.steps * (row * e.episodes + ROLLOUT_ROW * rollouts)


def _size(experiment: Experiment) -> str:
    """What makes a run long and large."""
    e = experiment
    return f"episodes = {e.episodes}, steps = {e.steps} and horizon = {e.horizon}"


def need_numba(why: str) -> None:
    """Say before any work what would end it.

    Args:
        why: what needs machine code, as a clause.

    Raises:
        Refusal: numba is not installed.
    """
    if environment()["numba"] == "absent":
        raise Refusal(f"numba is not installed, and {why}: `pip install numba`")
