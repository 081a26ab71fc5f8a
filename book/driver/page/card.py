"""What a shared link to a page shows: its title, and the robot on its way, by Open Graph.

The picture is drawn once a build. An address that others can follow needs to know where the book
will be: `html: baseurl` of _config.yml. Without it the picture is named from the page.
"""

import os
from html import escape
from pathlib import Path

import numpy as np
from bs4 import BeautifulSoup

from driver.project import from_yaml
from nmpcrl.learning.rollout import evaluate
from nmpcrl.report.figures.controller.plans import closed_loop
from nmpcrl.report.figures.sheet import Drawn, Sheet
from nmpcrl.study import paper

PICTURE = "_static/card.png"
SIZE = (1200, 630)  # pixels that a card shows whole, wherever it is shown
DOTS = 200  # an inch
EVERY = 16  # states there is a plan
TAG = '<meta property="og:{}" content="{}">\n'


def site(html: Path) -> None:
    """Draw the picture, and name it and the title in the head of every page, in place."""
    alt = drawn(html / PICTURE)
    for path in html.rglob("*.html"):
        if "_static" not in path.parts:
            text = path.read_text("utf-8")
            path.write_text(text.replace("</head>", f"{tags(text, path, html, alt)}</head>", 1))


def drawn(target: Path) -> str:
    """Write the picture of the first rollout; what it shows, in words."""
    nmpc, theta = paper.nmpc(), np.array(paper.THETA_INIT)
    rollout = evaluate(nmpc, theta, paper.STEPS)
    plans = [nmpc.solve(state, theta) for state in rollout.states[: -paper.HORIZON : EVERY]]
    figure = closed_loop(nmpc.task, rollout, plans)
    assert isinstance(figure, Drawn)
    assert figure.again
    width, height = (pixels / DOTS for pixels in SIZE)
    figure.again(Sheet(width, height=height)).savefig(target, dpi=DOTS)
    return figure.finding


def tags(page: str, path: Path, html: Path, alt: str) -> str:
    """The tags of a page, which a page without a title has none of."""
    title = BeautifulSoup(page.partition("</head>")[0], "html.parser").title
    if title is None:
        return ""
    config = from_yaml("_config.yml")
    base = config["html"].get("baseurl", "").rstrip("/")
    beside = Path(os.path.relpath(html / PICTURE, path.parent)).as_posix()
    facts = {
        "type": "article",
        "site_name": config["title"],
        "title": title.get_text().strip(),
        "description": " ".join(from_yaml("CITATION.cff")["abstract"].split()),
        "image": f"{base}/{PICTURE}" if base else beside,
        "image:width": SIZE[0],
        "image:height": SIZE[1],
        "image:alt": alt,
    }
    return "".join(TAG.format(name, escape(str(fact))) for name, fact in facts.items())
