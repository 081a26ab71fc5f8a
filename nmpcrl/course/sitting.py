"""Cells of one notebook, executed in this process and no other, which ends with it.

    python -m nmpcrl.course.sitting PLAN LOG MEGABYTES SECONDS CELL

PLAN is a JSON file, see `confined.run`. LOG, the number of an open file, gets a line when a cell
ends, so that whoever waits knows how far a process came that did not reach the end. SECONDS of
processor time are for all cells, CELL of the clock for one of an exercise or one that was added.
"""

import builtins
import json
import os
import resource
import signal
import sys
from pathlib import Path
from typing import Any, TextIO

from IPython.core.interactiveshell import InteractiveShell

from nmpcrl.course.confined import NO_MEMORY
from nmpcrl.course.outcome import Outcome
from nmpcrl.course.submissions import Step

FILE = 200_000_000  # bytes of the largest file that a notebook may write
END = Step("", "")

Names = dict[str, Any]


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


def sit(steps: list[Step], asked: set[str], log: TextIO, cell: int, *, restored: bool) -> None:
    """Execute the cells in their order; an error ends a cell, and not the notebook."""
    shell: Any = InteractiveShell.instance()
    shell.history_manager.enabled = False
    home, names, process = Path.cwd(), shell.user_ns, os.getpid()
    ours = dict(names)  # as the chapter last bound them
    for step, following in zip(steps, [*steps[1:], END], strict=True):
        before = dict(names)
        error, right = _executed(shell, step, cell)
        if os.getpid() != process:
            os._exit(0)  # the cell was left by a copy of the process, which must not go on
        if not step.theirs:
            ours |= {name: v for name, v in names.items() if before.get(name, before) is not v}
        other = _rebound(names, ours) - asked if step.theirs else set()
        end = {"name": step.name, "error": error, "right": right, "rebound": sorted(other)}
        print(json.dumps(end), file=log, flush=True)
        if restored and step.group and following.group != step.group:
            _restore(names, ours, asked)
            os.chdir(home)


def _executed(shell: Any, step: Step, cell: int) -> tuple[tuple[str, str] | None, bool]:
    """The error of a cell, if there is one, and whether it says that an answer is right."""
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # which ends the process
    signal.alarm(cell if step.group else 0)
    done = shell.run_cell(step.code, store_history=False)
    error = done.error_before_exec or done.error_in_exec
    if step.group and isinstance(error, MemoryError):
        os._exit(NO_MEMORY)  # what it took would be missing in other cells
    said = None if error is None else (type(error).__name__, str(error))
    signal.alarm(0)
    return said, isinstance(done.result, Outcome) and done.result.right


def _rebound(names: Names, ours: Names) -> set[str]:
    """Names of the chapter and of Python that mean something else now; `_` and the like may."""
    changed = {name for name, value in ours.items() if names.get(name, names) is not value}
    hidden = (vars(builtins).keys() & names.keys()) - ours.keys()
    return {name for name in changed | hidden if not name.startswith("_")}


def _restore(names: Names, ours: Names, asked: set[str]) -> None:
    """Give names of the chapter and of Python their meaning again; those of answers stay."""
    for name in _rebound(names, ours) - asked:
        if name in ours:
            names[name] = ours[name]
        else:
            del names[name]


def main(plan_file: str, *numbers: str) -> None:
    """Execute a plan, and end without waiting for what a notebook left running."""
    file, megabytes, seconds, cell = map(int, numbers)
    plan = json.loads(Path(plan_file).read_text("utf-8"))
    confine(megabytes, seconds)
    with os.fdopen(file, "w", encoding="utf-8") as log:
        steps = [Step(**step) for step in plan["steps"]]
        sit(steps, set(plan["asked"]), log, cell, restored=plan["restored"])
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
