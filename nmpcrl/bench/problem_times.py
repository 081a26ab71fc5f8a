"""How long problems take: of many sizes, and those of Chapter 10 beside mpcrl, kept as one file.

`nmpcrl bench --sizes` makes it, in some ten minutes.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from tqdm import tqdm

from nmpcrl.bench import processes, sealed
from nmpcrl.bench.problem_sizes import VARIED, Sizes, times
from nmpcrl.bench.solves import columns_of
from nmpcrl.study.files import check_folder, folder
from nmpcrl.study.limits import need_numba
from nmpcrl.study.refusal import Refusal

FILE = "problem_times.json"
STEPS = 1000  # of a run in Chapter 10


class DamagedTimes(Refusal):
    """A file is not what `make` wrote."""


@dataclass(frozen=True, eq=False)
class ProblemTimes:
    """What was measured."""

    sizes: pd.DataFrame  # of `problem_sizes.times`, each in a fresh process
    peers: pd.DataFrame  # of `beside_mpcrl`
    about: dict[str, Any]  # date, seconds, machine and versions


def make(*, progress: bool = True) -> ProblemTimes:
    """Measure everything, and keep it in `path`.

    Args:
        progress: whether to show a bar.

    Raises:
        StoreError: it could not be kept; nothing is measured.
        Refusal: numba is not installed, and nothing is compiled without it.
        ImportError: mpcrl is not installed.
    """
    need_numba("what is measured is the machine code that it compiles")
    check_folder()
    began = time.perf_counter()
    peers = beside_mpcrl()
    with tqdm(total=sum(map(len, VARIED.values())), disable=not progress, leave=False) as bar:
        sizes = times(measure=_noticed(processes.problem_of_sizes, bar))
    about = sealed.about(time.perf_counter() - began)
    content = {"sizes": columns_of(sizes), "peers": columns_of(peers), "about": about}
    sealed.save(path(), content)
    return ProblemTimes(sizes, peers, about)


def _noticed(
    measure: Callable[[Sizes], dict[str, float]], bar: Any
) -> Callable[[Sizes], dict[str, float]]:
    """The same, which tells a bar what it is at."""

    def noticed(sizes: Sizes) -> dict[str, float]:
        bar.set_description(str(tuple(sizes)))
        bar.update()
        return measure(sizes)

    return noticed


def beside_mpcrl() -> pd.DataFrame:
    """The problems of Chapter 10 and the paper's, by three solvers and by mpcrl, in this process.

    Returns:
        A row a problem: problem, states, inputs, horizon, parameters; solve_us (value and gradient,
        by riccati), fatrop_us (the same), csnlp_us (the value alone, by mpcrl's agent with Ipopt);
        run_s and mpcrl_run_s (of `STEPS` steps of Q-learning). All are the processor's means.
    """
    from nmpcrl.bench import peer_solves  # needs mpcrl

    rows = []
    for make_one in peer_solves.PROBLEMS:
        one, other = make_one(), make_one("fatrop")
        solve, slower = peer_solves.side_by_side(one), peer_solves.side_by_side(other)
        run = peer_solves.learning(one)
        rows.append(
            {
                "problem": one.name,
                "states": one.nmpc.n,
                "inputs": one.nmpc.m,
                "horizon": one.nmpc.horizon,
                "parameters": one.theta.size,
                "solve_us": 1e6 * solve.ours,
                "fatrop_us": 1e6 * slower.ours,
                "csnlp_us": 1e6 * solve.theirs,
                "run_s": STEPS * run.ours,
                "mpcrl_run_s": STEPS * run.theirs,
            }
        )
    return pd.DataFrame(rows)


def path() -> Path:
    """Where the latest times are kept, beside the benchmark."""
    return folder() / FILE


def read(place: Path) -> ProblemTimes:
    """What `make` kept.

    Raises:
        DamagedTimes: it is missing, or something else.
    """
    return sealed.read(place, _times, DamagedTimes, "nmpcrl bench --sizes")


def _times(kept: dict[str, Any]) -> ProblemTimes:
    sizes, peers = (pd.DataFrame(kept[name]) for name in ("sizes", "peers"))
    return ProblemTimes(sizes, peers, kept["about"])
