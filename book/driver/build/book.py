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
              the published ones end the build, and so do verdicts, as `studies.reproduce` says.
              What the live figures solve with is compiled meanwhile
4. `execute`  the chapters with papermill into PLACE/executed: make has a rule a chapter, so what
              nothing has made stale is not executed again
5. `dress`    the pages of the mirror: paragraphs, boxes and captions, as `enrich` says, exercises
              unsolved, as `questions` says, and the scripts of live figures, as `live` says
6. `render`   the mirror with Jupyter Book, every warning an error, into PLACE/html

PLACE/html is removed first and put there last: it exists only if everything went well.
"""

import os
import shutil
from pathlib import Path

import click

from driver.build.chapters import Given, ask, known, parameters, together, values
from driver.build.dress import dress
from driver.build.execute import execute_all
from driver.build.mirror import mirror
from driver.build.render import render
from driver.build.train import compiling_for_pages, measure, require_published, train
from driver.project import ROOT, Failure, notebooks, reported

SMOKE = {"episodes": 4, "length": "smoke", "layouts": ["A", "D"], "seeds": [0, 1], "budget": 40}


def build(place: Path, jobs: dict[Path, Given], announcement: str, strict: bool) -> Path:
    """The six steps."""
    with reported(place / "logs/build.log"):
        needs = together(ask(*job) for job in jobs.items())
        require_published()
        shutil.rmtree(place / "html", ignore_errors=True)
        mirror(place, announcement)
        with compiling_for_pages():
            train(needs.experiments, needs.summaries)
        measure(needs.beforehand)
        execute_all(place, jobs)
        for notebook in jobs:
            shutil.copy2(place / "executed" / notebook.name, place / "src" / notebook)
        dress(place / "src", jobs)
        render(place, strict)
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
