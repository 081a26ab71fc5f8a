"""The chapters executed by papermill, two at a time."""

import logging
import os
import tempfile
import time
import traceback
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path

import nbformat
import papermill
from papermill.exceptions import PapermillExecutionError
from tqdm import tqdm
from traitlets.config import Config

from driver.build.chapters import Given
from driver.page import enrich
from driver.project import ROOT, Failure, shown
from nmpcrl.study.provenance import hash_of

logging.getLogger("papermill").setLevel(logging.ERROR)  # a page without parameters is no news

KERNEL = {  # the environment of what executes a chapter
    "NMPCRL_FIGURES_FOR_PAGE": "1",  # narrow, too, for telephones: `pictures`
    "NO_COLOR": "1",
    "PYDEVD_DISABLE_FILE_VALIDATION": "1",
}

# In chapters that compile a plant or problem of their own, or read the runs of drawn layouts.
LONG = (b"Plant(", b"Problem(", b"study.problems", b"studies import population")


def weight(job: tuple[Path, Given]) -> tuple[bool, int]:
    """What is begun first: what compiles, or reads every run; and then the largest in bytes."""
    text = job[0].read_bytes()
    return any(word in text for word in LONG), len(text)


def execute_all(place: Path, jobs: dict[Path, Given]) -> None:
    """Execute notebooks (path -> given parameters), and put them into the mirror."""
    executed, logs = place / "executed", place / "logs"
    kept = [n for n, given in jobs.items() if still_good(executed / n.name, n, given)]
    for path in executed.glob("*"):
        if path.stem not in {notebook.stem for notebook in kept}:
            path.unlink()
    if kept:
        tqdm.write(f"  executed before: {', '.join(notebook.stem for notebook in kept)}")
    problems = {}
    with ProcessPoolExecutor(max_workers=2, mp_context=get_context("spawn")) as pool:
        running = {
            pool.submit(
                execute, notebook, executed / notebook.name, logs / f"{notebook.stem}.log", given
            ): notebook
            for notebook, given in sorted(jobs.items(), key=weight, reverse=True)
            if notebook not in kept
        }
        bar = tqdm(as_completed(running), "chapters", len(running), leave=False, disable=None)
        for done in bar:
            notebook, (seconds, problem) = running[done], done.result()
            tqdm.write(f"  {notebook.stem:<24}{seconds:6.0f} s{'  failed' if problem else ''}")
            if problem:
                problems[notebook.stem] = problem
    if problems:
        raise Failure(
            "\n".join(
                f"{name}: {problem} (all of it: {shown(logs / f'{name}.log')})"
                for name, problem in sorted(problems.items())
            )
        )
    for notebook in jobs:
        clean = enrich.without_notices(nbformat.read(executed / notebook.name, 4))
        for target in (executed / notebook.name, place / "src" / notebook):
            nbformat.write(clean, target)


def execute(notebook: Path, target: Path, log: Path, given: Given) -> tuple[float, str]:
    """Papermill one notebook; return the seconds it took and, if it failed, why in a sentence.

    For a process of its own: its environment and its stderr become the kernel's.
    """
    started = time.perf_counter()
    os.environ |= KERNEL
    target.parent.mkdir(parents=True, exist_ok=True)
    log.parent.mkdir(parents=True, exist_ok=True)
    os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    problem = ""
    try:
        with sockets() as kernels:
            papermill.execute_notebook(
                str(notebook),
                str(target),
                parameters=given,
                kernel_name="python3",
                cwd=str(ROOT),
                progress_bar=False,
                config=kernels,
            )
        finished(target).write_text(rests_on(notebook, given))
    except Exception as error:
        traceback.print_exc()
        problem = sentence(error)
    return time.perf_counter() - started, problem


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


def finished(executed: Path) -> Path:
    """What an executed notebook rests on stands here until its build is done."""
    return executed.with_suffix(".done")


def rests_on(notebook: Path, given: Given) -> str:
    """A hash of all that decides what a notebook comes to, but for times."""
    package, published = ROOT / "nmpcrl", ROOT / "book/published"
    read = [notebook, *sorted(package.rglob("*.py")), *sorted(published.glob("*"))]
    chosen = {
        name: value for name, value in (os.environ | KERNEL).items() if name.startswith("NMPCRL_")
    }
    return hash_of([[sha256(path.read_bytes()).hexdigest() for path in read], given, chosen])


def still_good(executed: Path, notebook: Path, given: Given) -> bool:
    """Whether a build that did not end executed this, and nothing has changed since."""
    done = finished(executed)
    return (
        executed.exists() and done.exists() and done.read_text("utf-8") == rests_on(notebook, given)
    )
