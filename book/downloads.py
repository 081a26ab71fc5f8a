"""The editions of the course as downloads of the built site, each a ZIP with the same bytes.

A page says with `<div class="course-downloads" data-editions="student"></div>` where links to them
stand. In a site without the files there are none: `make course` makes both, after `make book`.
Whole runs are large, and only students download them: the notebooks of others train them anew.
"""

import os
import re
from functools import partial
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

FOLDER = Path("_downloads/course")  # on the site
CONTENTS = {  # in words, by edition
    "student": "Notebooks for students, with empty answers",
    "instructor": "Notebooks for teachers, with solutions, notes, and the figures as SVG and PDF",
    "grader": "Notebooks for graders, marked for nbgrader",
    "slides": "Slides, a deck for each unit of two weeks",
}
WITHOUT_RUNS = ("instructor", "grader")  # but with their summaries
PLACE = re.compile(
    r'(?P<open><div class="course-downloads" data-editions="(?P<editions>[\w ]+)">).*?</div>',
    flags=re.S,
)
LIST = "<p>To download, with all that is needed without a network:</p><ul>{}</ul>"
LINK = '<li><a href="{}" download>{}</a> (ZIP, {:.1f} MB)</li>'


def zipped(folder: Path, target: Path) -> None:
    """A folder as a ZIP, which unpacks to a folder of its name; no date, the same bytes."""
    with ZipFile(target, "w") as archive:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            if folder.name in WITHOUT_RUNS and path.parent.name == "runs":
                continue
            name = folder.name / path.relative_to(folder)
            entry = ZipInfo(name.as_posix())  # of 1980
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes(), ZIP_DEFLATED)


def offer(folders: list[Path], site: Path) -> list[Path]:
    """Put folders on a built site as ZIPs, in the place of earlier ones, and link to them."""
    place = site / FOLDER
    place.mkdir(parents=True, exist_ok=True)
    for old in place.glob("*.zip"):
        old.unlink()
    made = [place / f"{folder.name}.zip" for folder in folders]
    for folder, target in zip(folders, made, strict=True):
        zipped(folder, target)
    link(site)
    return made


def link(site: Path) -> None:
    """Write links to the ZIPs that are there to where pages have a place for them."""
    for page in site.glob("book/*.html"):
        before = page.read_text("utf-8")
        after = PLACE.sub(partial(_linked, page=page, place=site / FOLDER), before)
        if after != before:
            page.write_text(after, "utf-8")


def _linked(found: re.Match[str], page: Path, place: Path) -> str:
    """A page's place with the links that belong there, of those whose files there are."""
    paths = [place / f"{name}.zip" for name in found["editions"].split()]
    items = "".join(_item(path, page) for path in paths if path.exists())
    return f"{found['open']}{items and LIST.format(items)}</div>"


def _item(path: Path, page: Path) -> str:
    href = Path(os.path.relpath(path, page.parent)).as_posix()
    return LINK.format(href, CONTENTS[path.stem], path.stat().st_size / 1e6)
