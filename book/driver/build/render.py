"""The pages as a site, by Jupyter Book."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import nbformat

from driver.page import questions
from driver.page.prose import calls_prose
from driver.project import ROOT, Failure, from_yaml, pages, shown

MOVED = {  # addresses of pages that are no more
    "book/api": "api_control.html",
    **dict.fromkeys(
        [f"book/api_{room}" for room in ("analysis", "bench", "claims", "report", "studies")],
        "api_study.html#api-rest",
    ),
    "book/cluster": "reproduce.html#reproduce-cluster",
    "book/06_what_the_paper_leaves_open": "06_why_learning_stops.html",
    "book/why_learning_stops": "06_why_learning_stops.html",
    "book/letter": "departures.html#departures-questions",
    "book/learn_alone": "teach.html#teach-alone",
    "book/performance": "solver.html",
    "book/your_problem": "09_your_own.html",
    "book/your_learner": "09_your_own.html#own-learner",
    "book/your_paper": "09_your_own.html#own-claim",
    "book/other_problems": "09_your_own.html#own-truth",
    "book/which_library": "09_your_own.html#own-library",
    "book/for_reviewers": "evidence.html",
    "book/reproducibility": "evidence.html",
    "book/paper_and_book": "departures.html#departures-numbers",
    **dict.fromkeys(["book/07_beyond", "book/what_to_try_first"], "07_what_to_try_first.html"),
    "book/the_suite": "07_what_to_try_first.html#first-enter",
    "book/changing_world": "08_changing_world.html",
}
ELSEWHERE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title>
<script>
  const page = "{page}", at = location.hash
    .replace(/^#(reviewers|reproducibility)-/, "#evidence-")
    .replace(/^#evidence-wrong$/, "#evidence-failed");
  if (at && !page.includes("#")) location.replace(page + at); // a place on a page that moved whole
</script>
<meta http-equiv="refresh" content="0; url={page}"></head>
<body><a href="{page}">{title}</a></body>
</html>
"""


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
        result = subprocess.run(
            command + strictness,
            stdout=out,
            stderr=subprocess.STDOUT,
            env=os.environ | {"NO_COLOR": "1"},
        )
    if result.returncode:
        raise Failure(f"Jupyter Book refused the pages (all of it: {shown(log)}):\n{warnings(log)}")
    for path in (place / "executed").glob("*.ipynb"):
        notebook = download(questions.opened(nbformat.read(path, 4)))
        nbformat.write(notebook, work / "_build/html/book" / path.name)
    (work / "_build/html").rename(place / "html")
    title = from_yaml("_config.yml")["title"]
    for old, new in {"index": f"{pages()[0]}.html", **MOVED}.items():
        (place / f"html/{old}.html").write_text(ELSEWHERE.format(title=title, page=new))


def download(executed: Any) -> Any:
    """An executed notebook for whoever opens it: prose without the calls that made it."""
    executed.metadata.pop("papermill", None)
    for cell in executed.cells:
        cell.metadata.pop("papermill", None)
        if cell.cell_type == "code" and calls_prose(cell.source):
            cell.metadata["jupyter"] = {"source_hidden": True}
    return executed


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
