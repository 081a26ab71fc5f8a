"""Print the built book as one PDF with an outline and tags: `make pdf`.

    python book/pdf.py                     _build/html/nmpcrl.pdf
    python book/pdf.py _build/smoke/html   _build/smoke/html/nmpcrl.pdf

Four steps, each a function:

1. `whole.document`  the pages of the site as one, in pdf/book.html beside it
2. `printed`         that document, by Chromium, once MathJax is done: first to learn on which page
                     each section begins, then with these numbers in the table of contents
3. `described`       the file: title, author, date, and which of its pictures are formulas
4. `offer`           it below the list of chapters on every page of the site

The file is removed first and put there last: it exists only if everything went well.
"""

import logging
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from datetime import datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import click
from pypdf import PdfReader, PdfWriter
from pypdf.generic import NameObject, TextStringObject

from driver.paper import whole
from driver.project import ROOT, Failure, from_yaml, reported, shown
from nmpcrl import __version__

logging.getLogger("pypdf").setLevel(logging.ERROR)  # a profile of colours that is copied is no news

NAME = "nmpcrl.pdf"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync")
PAPER: dict[str, Any] = {"format": "A4", "print_background": True, "tagged": True, "outline": True}
COLUMN: Any = {"width": 643, "height": 957}  # [px] of A4 that the margins of print.css leave
PATIENCE = 600_000  # [ms] until a page counts as stuck: a busy machine needs many times its load

READY = """async () => {
  await MathJax.startup.promise;
  await document.fonts.ready;
  await Promise.all([...document.images].map(image => image.decode()));
  for (const formula of document.querySelectorAll("[data-words]")) {
    const picture = formula.querySelector("svg");  // the PDF has words of what is painted only
    picture.removeAttribute("aria-hidden");
    picture.setAttribute("aria-label", formula.dataset.words);
    formula.querySelector("mjx-assistive-mml")?.remove();
  }
  for (const table of document.querySelectorAll("table")) {  // one that is too wide shrinks
    const share = table.parentElement.clientWidth / table.scrollWidth;
    if (share < 1) table.style.zoom = share;
  }
}"""
NUMBER = """numbers => {
  for (const link of document.querySelectorAll(".all-pages a"))
    link.lastElementChild.textContent = numbers[link.getAttribute("href").slice(1)] ?? "";
}"""

OFFER = """<ul class="nav bd-sidenav the-pdf">
<li class="toctree-l1">
<a class="reference internal" href="{}">The book as a PDF ({:.0f} MB)</a></li>
</ul>
"""
OFFERED = re.compile(r'<ul class="nav bd-sidenav the-pdf">.*?</ul>\n', flags=re.S)
CHAPTERS = re.compile(r'(<nav class="bd-links bd-docs-nav".*</ul>\n)(?=\s*</div>\s*</nav>)', re.S)


def chromium() -> str:
    """The command of the distribution's Chromium."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        raise Failure(
            f"The PDF is printed by a Chromium, and none of {', '.join(BROWSERS)} is installed: "
            "`apt-get install chromium`, or your system's like, installs one."
        )
    return path


def version() -> tuple[str, datetime]:
    """The version in words and its date: the commit's, or without git the published study's."""
    command = ["git", "-C", str(ROOT), "log", "-1", "--format=%h %cI"]
    try:
        found = subprocess.check_output(command, text=True, stderr=subprocess.DEVNULL)
        commit, date = found.split()
    except (OSError, subprocess.CalledProcessError):
        first, *_ = from_yaml("book/published/manifest.json")["runs"]["batches"]
        commit, date = "", first["date"]
    when = datetime.fromisoformat(date)
    words = f"Version {__version__}, {when.day} {when:%B %Y}"
    return words + (f", commit {commit}" if commit else ""), when


def printed(document: Path, browser: str) -> bytes:
    """A document as PDF, its table of contents with page numbers."""
    from playwright.sync_api import sync_playwright  # only here: a refusal should not wait for it

    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=browser, args=FLAGS) as chromium,
    ):
        return _printed(chromium, document, numbers(_printed(chromium, document, {})))


def opened(chromium: Any, viewport: Mapping[str, int]) -> Any:
    """A tab of this size [px], which waits for a page as long as a busy machine takes."""
    tab = chromium.new_page(viewport=viewport)
    tab.set_default_timeout(PATIENCE)
    return tab


def _printed(chromium: Any, document: Path, on: Mapping[str, int]) -> bytes:
    """A document, printed by a tab of its own: a second print of one tab may break elsewhere."""
    missing: list[str] = []
    tab = opened(chromium, COLUMN)
    tab.on("requestfailed", lambda request: missing.append(request.url))
    tab.emulate_media(media="print")
    tab.goto(document.resolve().as_uri())
    if missing:
        raise Failure(f"{shown(document)} needs what is not there: {', '.join(missing)}")
    tab.evaluate(READY)
    tab.evaluate(NUMBER, on)
    pdf: bytes = tab.pdf(**PAPER)
    tab.close()
    return pdf


def numbers(pdf: bytes) -> dict[str, int]:
    """On which page each destination of a PDF is, from 1."""
    reader: Any = PdfReader(BytesIO(pdf))
    return {
        name.removeprefix("/"): reader.get_destination_page_number(found) + 1
        for name, found in reader.named_destinations.items()
    }


def described(pdf: bytes, headings: list[str], date: datetime) -> bytes:
    """A PDF that says what it is, what its headings are, and which of its pictures are formulas."""
    config = from_yaml("_config.yml")
    writer = PdfWriter(clone_from=BytesIO(pdf))
    about = {"/Title": config["title"], "/Author": config["author"]}
    when = f"D:{date:%Y%m%d%H%M%S}"
    dates = {"/Creator": f"nmpcrl {__version__}", "/CreationDate": when, "/ModDate": when}
    writer.add_metadata(about | dates)
    writer.pdf_header = "%PDF-1.7"  # tags and transparency are younger than its default
    writer.page_mode = "/UseOutlines"
    for entry, words in zip(outline(writer.get_outline_root()), headings, strict=True):
        entry[NameObject("/Title")] = TextStringObject(words)  # Chromium's lacks the formulas
    for element in writer._objects:
        if isinstance(element, dict) and element.get("/S") == "/Figure":
            retag(element)
    out = BytesIO()
    writer.write(out)
    return out.getvalue()


def outline(entry: Any) -> Iterator[Any]:
    """The entries below one of an outline, in the order of the document."""
    child = entry.get("/First")
    while child is not None:
        yield child.get_object()
        yield from outline(child.get_object())
        child = child.get_object().get("/Next")


def retag(figure: Any) -> None:
    """What Chromium calls a figure may be a formula, or hold a figure with its caption."""
    words = str(figure.get("/Alt", ""))
    if not words:
        figure[NameObject("/S")] = NameObject("/Div")
    elif words.startswith(whole.FORMULA):
        figure[NameObject("/S")] = NameObject("/Formula")
        figure[NameObject("/Alt")] = TextStringObject(words.removeprefix(whole.FORMULA))


def offer(site: Path, size: int) -> None:
    """Link to the PDF below the list of chapters on every page that has one."""
    for path in site.rglob("*.html"):
        link = OFFER.format(os.path.relpath(site / NAME, path.parent), size / 1e6)
        page = OFFERED.sub("", path.read_text("utf-8"))
        path.write_text(CHAPTERS.sub(rf"\1{link}", page))


def make(site: Path) -> Path:
    """The four steps."""
    if not (site / "index.html").exists():
        raise Failure(f"There is no built book in {shown(site)}: `make book` builds it.")
    target, document = site / NAME, site.parent / "pdf/book.html"
    target.unlink(missing_ok=True)
    browser = chromium()
    document.parent.mkdir(exist_ok=True)
    words, date = version()
    text = whole.document(site, document, words)
    document.write_text(text)
    pdf = described(printed(document, browser), whole.headings(text), date)
    target.write_bytes(pdf)
    offer(site, len(pdf))
    return target


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("site", type=click.Path(path_type=Path), default=ROOT / "_build/html")
def main(site: Path) -> None:
    """Print the built book in SITE as one PDF."""
    with reported(site.parent / "logs/pdf.log"):
        path = make(site)
    count = len(PdfReader(path).pages)
    click.echo(f"{shown(path)}: {count} pages, {path.stat().st_size / 1e6:.1f} MB")
