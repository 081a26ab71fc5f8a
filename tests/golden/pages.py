"""The numbers of a built book: `python tests/golden/pages.py FOLDER > numbers.json`.

By page, all numbers of the visible text in their order, so that two builds can be compared.
"""

import json
import re
import sys
from pathlib import Path

from bs4 import BeautifulSoup

HIDDEN = ("script", "style", "template", "head", "svg")
NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:[.,]\d+)*(?:e[-+−]?\d+)?")


def numbers(page: Path) -> list[str]:
    """The numbers that a page shows, and those that its pictures are described with."""
    html = BeautifulSoup(page.read_text("utf-8"), "html.parser")
    for tag in html(HIDDEN):
        tag.decompose()
    for picture in html("img"):
        picture.append(f" {picture.get('alt', '')} ")
    return NUMBER.findall(html.get_text(" "))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    found = {page.relative_to(folder).as_posix(): numbers(page) for page in folder.rglob("*.html")}
    json.dump(found, sys.stdout, indent=0, sort_keys=True, ensure_ascii=False)
