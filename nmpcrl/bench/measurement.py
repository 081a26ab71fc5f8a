"""The timing table of this machine: measured once for this code, and kept beside the runs."""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import psutil

from nmpcrl.bench.learners import PROCESSES, time_learners_afresh
from nmpcrl.bench.paired import IDLE
from nmpcrl.study import lock, paper, provenance
from nmpcrl.study.files import check_folder, folder, write_json
from nmpcrl.study.machine import machine
from nmpcrl.study.parameters import one_of

LENGTHS = {  # fresh processes, and steps of each learner with each solver in every one of them
    "smoke": (2, 20),
    "short": (4, paper.STEPS),
    "full": (PROCESSES, 3 * paper.STEPS),
}


@dataclass(frozen=True, eq=False)
class Measurement:
    """Times of learning steps, and how they were taken."""

    timings: pd.DataFrame  # of `time_learners_afresh`
    length: str
    date: str
    seconds: float  # that it took
    others: float  # share of the cores that other programs used when it began
    machine: dict[str, Any]
    key: str  # a hash of all that the times depend on, but for what else the machine does

    def serves(self, length: str, *, calm: bool) -> bool:
        """Whether it is of this code and machine, long enough, and calm where that is asked for."""
        known, busy = list(LENGTHS), calm and self.timings.waited.max() > IDLE
        longer = known.index(self.length) >= known.index(length)
        return self.key == depends_on() and longer and not busy


def read_or_measure(length: str = "full", *, calm: bool = False) -> Measurement:
    """The timing table: read if this code was measured here, and at least so long; else measured.

    `length` is one of `LENGTHS`; with `calm`, what was measured while other programs ran is
    measured again.

    Raises:
        ParameterError: there is no such length.
        StoreError: it could not be stored; nothing is measured.
    """
    check(length)
    kept = stored()
    return kept if kept and kept.serves(length, calm=calm) else measure(length)


def measure(length: str) -> Measurement:
    """Time the learners, and keep the table in `path`; raises as `read_or_measure`."""
    check(length)
    check_folder()
    others, began = psutil.cpu_percent(1.0) / 100, time.perf_counter()
    found = Measurement(
        timings=time_learners_afresh(*LENGTHS[length]),
        length=length,
        date=datetime.now(UTC).date().isoformat(),
        seconds=time.perf_counter() - began,
        others=others,
        machine=machine(),
        key=depends_on(),
    )
    write_json(path(), asdict(found) | {"timings": found.timings.to_dict("list")})
    return found


def beforehand(length: str) -> tuple[Callable[[], Measurement], ...]:
    """What a build calls with the machine to itself, so that a chapter reads."""
    check(length)
    return (partial(read_or_measure, length, calm=True),)


def check(length: object) -> None:
    """Refuse what is not a name in `LENGTHS`, with a ParameterError."""
    one_of(LENGTHS).check("length", length)


def stored() -> Measurement | None:
    """The table that was kept last, if there is one."""
    try:
        kept = json.loads(path().read_text("utf-8"))
        return Measurement(**kept | {"timings": pd.DataFrame(kept["timings"])})
    except FileNotFoundError:
        return None
    except (OSError, ValueError, LookupError, TypeError) as error:
        print(f"{path()} is damaged ({error}) and is measured again", file=sys.stderr)
        return None


def path() -> Path:
    """The file, in the folder of the runs."""
    return folder() / "timings.json"


def depends_on() -> str:
    """The `key` of a table that is measured now."""
    own = sorted(Path(__file__).parent.glob("*.py"))
    bench = [lock.code(one.read_text("utf-8")) for one in own]
    return provenance.hash_of([lock.sources_hash(), bench, provenance.environment(), machine()])
