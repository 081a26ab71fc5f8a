"""The chapters executed by papermill: make has a rule a chapter, and `main` is its recipe."""

import json
import logging
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import nbformat
import papermill
from papermill.exceptions import PapermillExecutionError
from traitlets.config import Config

from driver.build.chapters import Given
from driver.project import ROOT, Failure, shown

logging.getLogger("papermill").setLevel(logging.ERROR)  # a page without parameters is no news

KERNEL = {  # the environment of what executes a chapter
    "NO_COLOR": "1",
    "PYDEVD_DISABLE_FILE_VALIDATION": "1",
}
COMPILED = re.compile(r"Compiling [^\n]* \(once on this machine[^\n]*\) \.\.\. done in \d+ s\.\n")


def execute_all(place: Path, jobs: dict[Path, Given]) -> None:
    """Let make execute notebooks (path -> given parameters) on all cores, the largest first.

    What is done stays done, until the chapter, what it is given, the library or published data
    change.
    """
    chosen = {name: value for name, value in os.environ.items() if name.startswith("NMPCRL_")}
    for notebook, given in jobs.items():
        path = place / "given" / f"{notebook.stem}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"parameters": given, "environment": chosen})
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text)
    largest = sorted(jobs, key=lambda path: path.stat().st_size, reverse=True)
    command = ["make", "--silent", "--keep-going", f"--jobs={os.cpu_count()}", f"PLACE={place}"]
    command += [f"BIN={Path(sys.executable).parent}"]
    command += [str(place / "executed" / notebook.name) for notebook in largest]
    outside = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    done = subprocess.run(command, env=outside, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        lines = done.stderr.splitlines()
        raise Failure("\n".join(sorted(one for one in lines if not one.startswith("make"))))


@click.command()
@click.argument("notebook", type=click.Path(path_type=Path))
@click.argument("target", type=click.Path(path_type=Path))
@click.argument("given", type=click.Path(path_type=Path))
def main(notebook: Path, target: Path, given: Path) -> None:
    """Execute one chapter with the parameters in a file."""
    os.chdir(ROOT)
    os.environ |= KERNEL
    started, name = time.perf_counter(), notebook.stem
    log, running = (target.parent.parent / one for one in (f"logs/{name}.log", "running"))
    for folder in (log.parent, running, target.parent):
        folder.mkdir(parents=True, exist_ok=True)
    said = os.dup(2)
    os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)  # the kernel's, too
    try:
        with sockets() as kernels:
            papermill.execute_notebook(
                str(notebook),
                str(running / notebook.name),
                parameters=json.loads(given.read_text("utf-8"))["parameters"],
                kernel_name="python3",
                cwd=str(ROOT),
                progress_bar=False,
                config=kernels,
            )
    except Exception as error:
        traceback.print_exc()
        os.write(said, f"{name}: {sentence(error)} (all of it: {shown(log)})\n".encode())
        raise SystemExit(1) from error
    finally:
        click.echo(f"  {name:<24}{time.perf_counter() - started:6.0f} s")
    nbformat.write(without_notices(nbformat.read(running / notebook.name, 4)), target)


@contextmanager
def sockets() -> Iterator[Config]:
    """How a kernel is talked to: through files in a folder of its own.

    A port that was free may be taken before it is opened, and so may a file in a folder that
    kernels share: then two kernels get each other's messages, and one of them never answers.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as place:
        files = {"transport": "ipc", "ip": f"{place}/kernel"}
        yield Config() if os.name == "nt" else Config({"KernelManager": files})


def sentence(error: Exception) -> str:
    if not isinstance(error, PapermillExecutionError):
        return f"{type(error).__name__}: {error}"
    if error.ename == "ParameterError":
        return str(error.evalue)
    return f"cell {error.cell_index} failed with {error.ename}: {error.evalue}"


def without_notices(executed: Any) -> Any:
    """An executed notebook without what the first solve of a plant says on a new machine.

    Everything else on standard error stays, and ends the build.
    """
    for cell in executed.cells:
        outputs = cell.get("outputs", [])
        said = [one for one in outputs if one.get("name") == "stderr"]
        left = COMPILED.sub("", "".join(one.text for one in said))
        others = [one for one in outputs if one not in said]
        kept = [nbformat.v4.new_output("stream", name="stderr", text=left)] if left else []
        if said:
            cell.outputs = [*kept, *others]
    return executed
