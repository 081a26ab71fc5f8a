"""Cells of one notebook, executed in this process and no other, which ends with it.

    python -m nmpcrl.course.sitting PLAN LOG MEMORY SECONDS

PLAN is a JSON list of pairs of a cell's name and its code. LOG gets a line when a cell begins and
one when it ends, so that whoever waits knows where a process ended that did not reach the end.
"""

import json
import resource
import sys
from pathlib import Path
from typing import Any, TextIO

from IPython.core.interactiveshell import InteractiveShell

from nmpcrl.course.outcome import Outcome

FILE = 200_000_000  # bytes of the largest file that a notebook may write


def confine(megabytes: int, seconds: int) -> None:
    """Set the limits of this process: data in memory, processor time, and sizes of files."""
    limits = {
        resource.RLIMIT_DATA: megabytes * 1_000_000,
        resource.RLIMIT_CPU: seconds,
        resource.RLIMIT_FSIZE: FILE,
        resource.RLIMIT_CORE: 0,
    }
    for limit, value in limits.items():
        hard = resource.getrlimit(limit)[1]
        within = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(limit, (within, hard))


def sit(plan: list[tuple[str, str]], log: TextIO) -> None:
    """Execute the cells in their order; an error ends a cell, and not the notebook."""
    shell: Any = InteractiveShell.instance()
    shell.history_manager.enabled = False
    for name, code in plan:
        _write(log, name=name)
        done = shell.run_cell(code, store_history=False)
        error = done.error_before_exec or done.error_in_exec
        said = None if error is None else (type(error).__name__, str(error))
        _write(log, name=name, error=said, right=isinstance(done.result, Outcome))


def _write(log: TextIO, **line: Any) -> None:
    print(json.dumps(line), file=log, flush=True)


if __name__ == "__main__":
    plan_file, log_file, *numbers = sys.argv[1:]
    confine(*map(int, numbers))
    with Path(log_file).open("w") as log_of_cells:
        sit(json.loads(Path(plan_file).read_text()), log_of_cells)
