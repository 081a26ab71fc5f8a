"""The targets of the benchmark, a row each, with what was measured."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from nmpcrl.bench import summary
from nmpcrl.bench.solves import LOOPS
from nmpcrl.bench.summary import Bench
from nmpcrl.study import paper

SOLVE = (45.0, 120.0)  # [us] median and 95th percentile of a solve in its own loop
TIMES = {"fatrop": 15.0, "ipopt": 40.0, "ipopt MX": 90.0}  # as long as with riccati
MPCRL = 60.0  # times as long as a step of ES
RUN = {"ES": 5.0, "GES": 5.0, "RDES": 22.0, "DES": 22.0}  # [s] of a whole run
LINEAR = 1.5
SPEED_UP = 1.8  # of two workers
FIRST = {True: 1.0, False: 40.0}  # [s] with machine code kept from before, and without
MEMORY = 600.0  # [MB]
BUSY = 0.95  # share of its time that the processor works on a run, unless others want it, too
FLAT = 0.05  # share by which memory may grow after a tenth of the episodes


@dataclass(frozen=True)
class Target:
    """A target, and what was measured."""

    what: str
    to_reach: str
    measured: str
    reached: bool | None  # None where it was not measured

    @property
    def outcome(self) -> str:
        """In a word or two."""
        return {True: "reached", False: "missed", None: "not measured"}[self.reached]


def targets(bench: Bench) -> list[Target]:
    """Every target, in the order of a reader's questions."""
    return [
        *_own_loop(bench),
        *_against_others(bench),
        *_runs(bench),
        *_scaling(bench),
        *_processes(bench),
        _memory(bench),
    ]


def shown(listed: Iterable[Target]) -> str:
    """Targets as a table for a terminal."""
    texts = [(t.what, t.to_reach, t.measured, t.outcome) for t in listed]
    rows = [("what", "target", "measured", "outcome"), *texts]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(" | ".join(map(str.ljust, row, widths)) for row in rows)


def _own_loop(bench: Bench) -> Iterator[Target]:
    median, p95 = SOLVE
    for loop, row in summary.own_loop(bench).iterrows():
        yield Target(
            f"solve and gradient, warm, in its own loop, {loop}",
            f"at most {median:.0f} µs median, {p95:.0f} µs p95",
            f"{row['median']:.0f} µs, {row.p95:.0f} µs",
            bool(row["median"] <= median and row.p95 <= p95),
        )


def _against_others(bench: Bench) -> Iterator[Target]:
    loops = list(LOOPS)
    times = summary.solvers(bench).times.unstack("loop")[loops]
    for solver, least in TIMES.items():
        rounded = {loop: f"{value:.0f}x" for loop, value in times.loc[solver].items()}
        shown = " and ".join(f"{value} {loop}" for loop, value in rounded.items())
        if len(set(rounded.values())) == 1:
            shown = f"{rounded[loops[0]]} with and without noise"
        yield Target(
            f"{NAMES[solver]} on the same problems, warm",
            f"at least {least:.0f}x as long",
            shown,
            bool((times.loc[solver] >= least).all()),
        )
    theirs, ours = summary.against_mpcrl(bench)
    yield Target(
        "a learning step of mpcrl, relative to one of ES",
        f"at least {MPCRL:.0f}x as long",
        f"{theirs / ours:.0f}x ({theirs:.1f} ms, {1e3 * ours:.0f} µs)" if theirs > 0 else "–",
        bool(theirs / ours >= MPCRL) if theirs > 0 else None,
    )


NAMES = {"fatrop": "fatrop", "ipopt": "Ipopt (SX)", "ipopt MX": "Ipopt as commonly written (MX)"}


def _runs(bench: Bench) -> Iterator[Target]:
    done = min(bench["runs"]["episodes"])
    extended = "" if done >= paper.EPISODES else f", extended from {done} episodes"
    for learner, row in summary.runs(bench).iterrows():
        waited = "" if row.processor > BUSY else f", of which the processor {row.processor:.0%}"
        yield Target(
            f"{paper.EPISODES} episodes of {learner} on one core",
            f"at most {RUN[str(learner)]:.0f} s",
            f"{row.seconds:.1f} s{waited}{extended}",
            bool(row.seconds <= RUN[str(learner)]),
        )


def _scaling(bench: Bench) -> Iterator[Target]:
    for varied, part, of in (
        ("horizon", "stage", "stages"),
        ("obstacles", "constraint", "obstacles"),
    ):
        sizes = summary.scaling(bench, varied).index
        most, (low, high) = summary.most_per_part(bench, varied), summary.marginal(bench, varied)
        yield Target(
            f"growth from {sizes[0]} to {sizes[-1]} {of}",
            f"linear: time per {part} within {LINEAR}x",
            f"{_growth(most)}; one more adds {_between(low, high)} µs to an iteration",
            bool(most <= LINEAR and high <= LINEAR * low),
        )


def _processes(bench: Bench) -> Iterator[Target]:
    workers, times = summary.speed_up(bench)
    yield Target(
        "runs on 2 cores",
        f"at least {SPEED_UP}x as fast",
        f"{times:.2f}x with {workers} workers" if workers > 1 else "–",
        times >= SPEED_UP if workers > 1 else None,
    )
    for cached, most in FIRST.items():
        seconds, noticed = summary.first_call(bench, cached=cached)
        notice = "" if cached else ", with a notice" if noticed else ", without a notice"
        yield Target(
            f"first call, machine code {'cached' if cached else 'not cached'}",
            f"at most {most:.0f} s{'' if cached else ', with a notice'}",
            f"{seconds:.1f} s{notice}" if np.isfinite(seconds) else "–",
            bool(seconds <= most and (cached or noticed)) if np.isfinite(seconds) else None,
        )


def _memory(bench: Bench) -> Target:
    runs = summary.runs(bench)
    return Target(
        "memory of a run",
        f"at most {MEMORY:.0f} MB, flat over episodes",
        f"{runs.memory.max():.0f} MB, {_change(runs.memory_growth.max())} after the first tenth",
        bool(runs.memory.max() <= MEMORY and runs.memory_growth.max() <= FLAT),
    )


def _between(low: float, high: float) -> str:
    """ "0.29 to 0.31", or "0.30" where both are shown so."""
    first, last = f"{low:.2f}", f"{high:.2f}"
    return first if first == last else f"{first} to {last}"


def _change(share: float) -> str:
    """ "+0.4%", or "unchanged" where that would be zero."""
    shown = f"{share:+.1%}"
    return "unchanged" if shown in ("+0.0%", "-0.0%") else shown


def _growth(factor: float) -> str:
    """ "at most 1.20x that of a smaller size", or in words where there is none."""
    shown = f"{factor:.2f}x"
    return "no growth" if shown == "1.00x" else f"at most {shown} that of a smaller size"
