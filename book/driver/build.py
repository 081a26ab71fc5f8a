"""Build the book: refuse nonsense, train what is missing, execute the chapters, render the pages.

    python book/build.py                                   all chapters   _build
    python book/build.py --smoke                           few episodes   _build/smoke
    python book/build.py --chapter 03_rdes -p episodes 20  one chapter    _build/chapter/03_rdes

Each build has its own place, in the last column, and six steps, each a function:

1. `ask`      run the two first cells of each chapter, its parameters and their check: a bad value
              ends here, in one sentence; a good one says which `experiments` the chapter needs
              whole, of which runs it needs `summaries`, and what is to be done `beforehand`, with
              the machine to itself. A build without `book/published` ends here, too
2. `mirror`   copy _config.yml, _toc.yml and book/ to PLACE/src, and MathJax from its package
3. `train`    what of these is not stored, once the solver is compiled; runs that contradict
              the published ones end the build, and so do verdicts, as `claims.agreement` says.
              What the live figures solve with is compiled meanwhile
4. `execute`  the chapters with papermill, the exercises solved, two at a time, into PLACE/executed
5. `dress`    the pages of the mirror: numbers, references and boxes, as `enrich` says, exercises
              unsolved, as `questions` says, the scripts of live figures, as `live` says, and
              minutes and plans, as `teaching` says
6. `render`   the mirror with Jupyter Book, every warning an error, into PLACE/html, its pages
              repaired for all readers, as `accessible` says

PLACE/html is removed first and put there last: it exists only if everything went well. What was
executed before something went wrong is not executed again, as long as nothing it rests on changed.
"""

import os

# One thread a process, kernels included, and before NumPy or torch is imported.
os.environ |= {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
os.environ |= {"PYDEVD_DISABLE_FILE_VALIDATION": "1", "NO_COLOR": "1"}
os.environ["NMPCRL_STRICT"] = "1"  # a solution that its check refuses ends the build
os.environ["NMPCRL_FIGURES_FOR_PAGE"] = "1"  # narrow, too, for telephones: `pictures`

import difflib
import logging
import re
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib.resources import as_file, files
from multiprocessing import get_context
from pathlib import Path
from typing import IO, Any

import click
import nbformat
import papermill
import yaml
from papermill.exceptions import PapermillExecutionError
from tqdm import tqdm
from traitlets.config import Config

from driver.page import accessible, enrich, live, pictures, questions
from driver.teaching import teaching
from nmpcrl.course import exercises
from nmpcrl.study.provenance import hash_of

logging.getLogger("papermill").setLevel(logging.ERROR)  # a page without parameters is no news

Given = dict[str, Any]  # parameters of a chapter by name

ROOT = Path(__file__).resolve().parents[2]
SMOKE = {"episodes": 4, "length": "smoke", "layouts": ["A", "D"], "seeds": [0, 1], "budget": 40}
BUTTONS = ("use_repository_button", "use_edit_page_button", "use_issues_button")
INDEX = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title>
<meta http-equiv="refresh" content="0; url={page}.html"></head>
<body><a href="{page}.html">{title}</a></body>
</html>
"""


class Failure(click.ClickException):
    """A sentence for the reader; the details are in a log."""

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo(self.message, file=sys.stderr)


@contextmanager
def reported(log: Path) -> Iterator[None]:
    """Turn an error that no step foresaw into a sentence and a log."""
    try:
        yield
    except Failure:
        raise
    except Exception as error:
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(traceback.format_exc())
        raise Failure(
            f"The build failed with {type(error).__name__}: {error} (all of it: {shown(log)})"
        ) from error


def pages() -> list[str]:
    """The pages of _toc.yml in their order, without suffix."""
    toc = yaml.safe_load((ROOT / "_toc.yml").read_text("utf-8"))
    return [toc["root"], *(page["file"] for part in toc["parts"] for page in part["chapters"])]


def notebooks() -> dict[str, Path]:
    """The pages that are notebooks: name -> path from the root."""
    paths = [Path(f"{page}.ipynb") for page in pages()]
    return {path.stem: path for path in paths if (ROOT / path).exists()}


def parameters(notebook: Path) -> list[str]:
    """The names a notebook's cell tagged `parameters` declares."""
    return list(papermill.inspect_notebook(str(notebook)))


def known(chapter: str) -> Path:
    """The path of `chapter`, or a refusal that lists the chapters."""
    paths = notebooks()
    name = Path(chapter).stem
    if name not in paths:
        raise Failure(
            f"There is no chapter {chapter!r}{nearest(name, paths)}; "
            f"the chapters are {listed(paths)}."
        )
    return paths[name]


def refuse_unknown(notebook: Path, given: Given) -> None:
    """Papermill only logs a misspelt name; here it ends the build."""
    names = parameters(notebook)
    for name in given:
        if name not in names:
            raise Failure(
                f"{notebook.stem} has no parameter {name!r}{nearest(name, names)}; "
                f"its parameters are {listed(names)}."
            )


NEEDS = ("experiments", "summaries", "beforehand")


def ask(notebook: Path, given: Given) -> dict[str, tuple[Any, ...]]:
    """What a chapter needs: run its parameters cell, set `given`, run its check cell.

    Returns what that cell gives each of `NEEDS`.
    """
    refuse_unknown(notebook, given)
    cells = [cell for cell in nbformat.read(notebook, 4).cells if cell.cell_type == "code"]
    if not cells or "parameters" not in cells[0].metadata.get("tags", []):
        return dict.fromkeys(NEEDS, ())
    names = {"__name__": "__main__"}
    try:
        exec(cells[0].source, names)
        names.update(given)
        exec(cells[1].source, names)
    except ValueError as error:  # ParameterError: the chapter's own sentence
        raise Failure(str(error)) from error
    return {need: tuple(names.get(need, ())) for need in NEEDS}


def nearest(name: str, names: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, names, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def listed(names: Iterable[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def mirror(place: Path, announcement: str) -> Path:
    """Copy the sources to PLACE/src, where chapters may be replaced by their executed selves."""
    source = place / "src"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(
        ROOT / "book", source / "book", ignore=shutil.ignore_patterns("__pycache__", ".*")
    )
    shutil.copy2(ROOT / "_toc.yml", source)
    (source / "nmpcrl").symlink_to(ROOT / "nmpcrl")  # for literalinclude
    config = yaml.safe_load((ROOT / "_config.yml").read_text("utf-8"))
    config["html"]["announcement"] = announcement
    if config["repository"]["url"]:
        config["html"] |= dict.fromkeys(BUTTONS, True)
    (source / "_config.yml").write_text(yaml.safe_dump(config, allow_unicode=True))
    with as_file(files("sphinx-mathjax-offline") / "static/mathjax/tex-svg-full.js") as script:
        target = source / "book/_static/mathjax"
        target.mkdir()
        shutil.copy2(script, target)
    return source


def require_published() -> None:
    """End the build, before any work, if there is nothing to compare its runs with."""
    from nmpcrl.claims import published  # only here: a refusal should not wait for it

    try:
        published.load()
    except published.Damaged as error:
        raise Failure(str(error)) from error


@contextmanager
def compiling_for_pages() -> Iterator[None]:
    """Compile what live figures solve with beside other work: two chapters would wait for it."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        compiled = pool.submit(compile_for_pages)
        yield
        compiled.result()


def compile_for_pages() -> None:
    """Compile that module, unless it is kept; where it cannot be had, the figures say so."""
    from nmpcrl.control.codegen.source import CannotCompile
    from nmpcrl.learning import browser
    from nmpcrl.study import Experiment
    from nmpcrl.study.setup import controller_of

    nmpc = controller_of(Experiment()).nmpc
    with suppress(CannotCompile):
        browser.module(nmpc.plant, nmpc.task)


def train(experiments: tuple[Any, ...], summaries: tuple[Any, ...]) -> None:
    """Run what is not stored yet; the bars are the store's."""
    from nmpcrl.analysis.summaries import fetch_summaries
    from nmpcrl.claims import agreement, comparison, published
    from nmpcrl.study import Experiment
    from nmpcrl.study.provenance import warn_of_changes
    from nmpcrl.study.setup import compile_ahead
    from nmpcrl.study.store import fetch_all

    warn_of_changes()  # no page is a place for this notice, nor for that of the compiler
    compile_ahead((*experiments, *summaries) or (Experiment(),))
    fetch_all(experiments, progress=True)
    made, known = fetch_summaries(summaries), published.load()
    contradictions = comparison.compare(made, known)
    if len(contradictions):
        raise Failure(
            "Runs that were trained here contradict the published ones:\n"
            f"{contradictions.to_string(index=False)}"
        )
    refuse_verdicts(agreement.of_runs(made, known))


def measure(calls: tuple[Callable[[], Any], ...]) -> None:
    """What is to be done with the machine to itself; times have their verdicts, too."""
    from nmpcrl.bench import summary
    from nmpcrl.claims import agreement, published

    for call in calls:
        measured = call()
        if isinstance(measured, dict) and "learners" in measured:
            refuse_verdicts(agreement.of_times(summary.learners(measured), published.load()))


def refuse_verdicts(contradictions: tuple[str, ...]) -> None:
    """End the build if a verdict that was found here contradicts the published one."""
    if contradictions:
        listed = "\n".join(contradictions)
        raise Failure(f"Verdicts that were found here contradict the published ones:\n{listed}")


def execute(notebook: Path, target: Path, log: Path, given: Given) -> tuple[float, str]:
    """Papermill one notebook; return the seconds it took and, if it failed, why in a sentence."""
    started = time.perf_counter()
    target.parent.mkdir(parents=True, exist_ok=True)
    source = solved(notebook, target.parent.parent / "solved")
    log.parent.mkdir(parents=True, exist_ok=True)
    os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)  # the kernel's stderr, too
    problem = ""
    try:
        with sockets() as kernels:
            papermill.execute_notebook(
                str(source),
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


def finished(executed: Path) -> Path:
    """What an executed notebook rests on stands here until its build is done."""
    return executed.with_suffix(".done")


def rests_on(notebook: Path, given: Given) -> str:
    """A hash of all that decides what a notebook comes to, but for times."""
    package, published = ROOT / "nmpcrl", ROOT / "book/published"
    read = [notebook, *sorted(package.rglob("*.py")), *sorted(published.glob("*"))]
    chosen = {name: value for name, value in os.environ.items() if name.startswith("NMPCRL_")}
    return hash_of([[sha256(path.read_bytes()).hexdigest() for path in read], given, chosen])


def still_good(executed: Path, notebook: Path, given: Given) -> bool:
    """Whether a build that did not end executed this, and nothing has changed since."""
    done = finished(executed)
    return (
        executed.exists() and done.exists() and done.read_text("utf-8") == rests_on(notebook, given)
    )


def solved(notebook: Path, folder: Path) -> Path:
    """Write a notebook with the answers of its solutions, so that a wrong solution ends a build."""
    folder.mkdir(parents=True, exist_ok=True)
    nbformat.write(exercises.solved(nbformat.read(notebook, 4)), folder / notebook.name)
    return folder / notebook.name


def sentence(error: Exception) -> str:
    if not isinstance(error, PapermillExecutionError):
        return f"{type(error).__name__}: {error}"
    if error.ename == "ParameterError":
        return str(error.evalue)
    return f"cell {error.cell_index} failed with {error.ename}: {error.evalue}"


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
            for notebook, given in reversed(jobs.items())  # the later chapters take longest
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


def dress(source: Path, executed: Iterable[Path]) -> None:
    """Give the pages of the mirror what they have beyond their sources."""
    read = {path: nbformat.read(source / path, 4) for path in notebooks().values()}

    def output(page: str, tag: str) -> str:
        return enrich.output(read[Path("book") / page], tag)

    (source / "book" / pictures.FOLDER).mkdir(exist_ok=True)
    live.add_runs(read.values(), source / "book/_static/live")
    for path in source.glob("book/*.md"):
        text = pictures.beside(path.read_text("utf-8"), path.parent)
        path.write_text(teaching.filled(enrich.page(text, output)))
    for path, notebook in read.items():
        live.share(notebook, path, source / "book/_static/live")
        download = path.name if path in executed else ""
        dressed = enrich.notebook(questions.placed(notebook), download)
        teaching.headed(dressed, path.stem)
        for name, data in pictures.placed(dressed).items():
            (source / "book" / pictures.FOLDER / name).write_bytes(data)
        nbformat.write(dressed, source / path)


def render(place: Path, strict: bool) -> None:
    """Run Jupyter Book on the mirror and put the result at PLACE/html, if it is whole.

    The executed notebooks lie beside their pages.
    """
    work, log = place / "render", place / "logs/render.log"
    shutil.rmtree(work, ignore_errors=True)  # a remembered page would not repeat its warnings
    log.parent.mkdir(parents=True, exist_ok=True)
    command = ["jupyter-book", "build", str(place / "src"), "--path-output", str(work)]
    command[0] = str(Path(sys.executable).with_name(command[0]))
    strictness = ["-W", "-n", "--keep-going"] if strict else []
    with log.open("w") as out:
        result = subprocess.run(command + strictness, stdout=out, stderr=subprocess.STDOUT)
    if result.returncode:
        raise Failure(f"Jupyter Book refused the pages (all of it: {shown(log)}):\n{warnings(log)}")
    for path in (place / "executed").glob("*.ipynb"):
        notebook = pictures.plain(enrich.download(exercises.reopened(nbformat.read(path, 4))))
        nbformat.write(notebook, work / "_build/html/book" / path.name)
    accessible.site(work / "_build/html")
    (work / "_build/html").rename(place / "html")
    title = yaml.safe_load((ROOT / "_config.yml").read_text("utf-8"))["title"]
    (place / "html/index.html").write_text(INDEX.format(title=title, page=pages()[0]))


def warnings(log: Path, most: int = 20) -> str:
    """The lines of a Sphinx log that say what is wrong, or its end if none does."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", log.read_text("utf-8")).replace(f"{ROOT}/", "")
    text = re.sub(r"\.ipynb:(\d+)(\d{4}):", in_cell, text)
    lines = text.splitlines()
    wrong = [line for line in lines if "WARNING: " in line or "ERROR: " in line]
    return "\n".join(f"  {line}" for line in (wrong[:most] or lines[-most:]))


def in_cell(place: re.Match[str]) -> str:
    """MyST-NB counts 10000 lines a cell, from cell 1: name the cell, from 0, and the line."""
    return f".ipynb, cell {int(place[1]) - 1}, line {int(place[2])}:"


def shown(path: Path) -> str:
    return os.path.relpath(path, ROOT)


def values(
    pairs: Iterable[tuple[str, str]], raw: Iterable[tuple[str, str]], texts: Iterable[str]
) -> Given:
    """Parameters as papermill's own -p, -r and -y read them."""
    given: Given = {}
    for text in texts:
        try:
            given |= yaml.safe_load(text)
        except (yaml.YAMLError, TypeError) as error:
            raise Failure(f"-y takes a form such as '{{seeds: [3]}}', not {text!r}.") from error
    given |= {name: typed(value) for name, value in pairs}
    return given | dict(raw)


def typed(text: str) -> Any:
    """A value as `papermill -p` reads it: a truth, nothing, a number, or else a text."""
    words = {"True": True, "False": False, "None": None}
    if text in words:
        return words[text]
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text)
    return text


def build(place: Path, jobs: dict[Path, Given], announcement: str, strict: bool) -> Path:
    """The six steps."""
    with reported(place / "logs/build.log"):
        needs = [ask(notebook, given) for notebook, given in jobs.items()]
        require_published()
        shutil.rmtree(place / "html", ignore_errors=True)
        mirror(place, announcement)
        wanted = {n: tuple(dict.fromkeys(one for need in needs for one in need[n])) for n in NEEDS}
        with compiling_for_pages():
            train(wanted["experiments"], wanted["summaries"])
        measure(wanted["beforehand"])
        execute_all(place, jobs)
        dress(place / "src", jobs)
        render(place, strict)
        for notebook in jobs:
            finished(place / "executed" / notebook.name).unlink()
    return place / "html"


def build_chapter(name: str, given: Given) -> Path:
    """Execute one chapter; the other pages are there to be referred to. Returns its page."""
    notebook = known(name)
    changed = ", ".join(f"{name} = {value}" for name, value in given.items())
    note = f"Only {notebook.stem} was executed for this build, with {changed or 'its defaults'}."
    place = Path("_build/chapter") / notebook.stem
    return build(place, {notebook: given}, note, strict=False) / notebook.with_suffix(".html")


def build_book(smoke: bool) -> Path:
    """Execute every chapter. Returns the page to open."""
    jobs: dict[Path, Given] = {notebook: {} for notebook in notebooks().values()}
    if not smoke:
        return build(Path("_build"), jobs, "", strict=True) / "index.html"
    for notebook in jobs:
        jobs[notebook] = {name: SMOKE[name] for name in parameters(notebook) if name in SMOKE}
    note = "A smoke build: a few episodes a run, to see that everything works; no number counts."
    return build(Path("_build/smoke"), jobs, note, strict=True) / "index.html"


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--smoke", is_flag=True, help=f"Train only {SMOKE['episodes']} episodes a run.")
@click.option("--chapter", metavar="NAME", help="Execute and show only this chapter.")
@click.option(
    "-p", "pairs", nargs=2, multiple=True, metavar="NAME VALUE", help="As papermill does."
)
@click.option("-r", "raw", nargs=2, multiple=True, metavar="NAME TEXT", help="Kept as a text.")
@click.option("-y", "texts", multiple=True, help="Parameters as YAML: '{seeds: [3]}'.")
def main(
    smoke: bool,
    chapter: str | None,
    pairs: tuple[tuple[str, str], ...],
    raw: tuple[tuple[str, str], ...],
    texts: tuple[str, ...],
) -> None:
    """Train what is missing, execute the chapters, build the book."""
    os.chdir(ROOT)
    given = values(pairs, raw, texts)
    if chapter is not None:
        click.echo(build_chapter(chapter, given))
    elif given:
        raise Failure("Parameters are given to one chapter: add --chapter NAME.")
    else:
        click.echo(build_book(smoke))
