"""What all figures share: the look of each learner, of a line and of a page."""

import re
from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties

from nmpcrl import Vector
from nmpcrl.report.figures.sheet import mosaic as mosaic
from nmpcrl.report.figures.sheet import page as page
from nmpcrl.report.figures.sheet import subplots as subplots
from nmpcrl.study.paper import THETA_NAMES


@dataclass(frozen=True)
class Look:
    """How a learner is drawn, everywhere; distinct in grey, and to the colour-blind."""

    color: str
    linestyle: Any  # as matplotlib takes it
    marker: str

    @property
    def line(self) -> dict[str, Any]:
        """Keyword arguments of a line without markers."""
        return {"color": self.color, "linestyle": self.linestyle}


LOOKS = {
    "ES": Look("#0072B2", "-", "o"),
    "DES": Look("#000000", "--", "s"),
    "RDES": Look("#009E73", "-.", "^"),
    "GES": Look("#D55E00", (0, (5, 1)), "D"),
    "TDC": Look("#BC6299", (0, (4, 1, 1, 1, 1, 1)), "v"),
    "QL": Look("#2A8FC7", (0, (8, 3)), "P"),
    "frozen": Look("#8A8A8A", ":", "x"),
    "matched": Look("#B37A00", (0, (2, 1)), "<"),
    "random": Look("#8C5A2B", (0, (1, 1)), ">"),
}

INK, TEAL, WINE = "0.25", "#1B7F79", "#882255"  # none of them is a learner's
AT_ONE: dict[str, Any] = {"color": "0.5", "linewidth": 0.9}  # what a ratio is compared to
BAND: dict[str, Any] = {"facecolor": "0.92", "edgecolor": "0.5", "linewidth": 0.6, "zorder": 0}
MARK = 78  # characters of a line
QUIET = "0.55"  # the grey of what only stands behind
PALE = 0.8  # of a grey that is too pale to be seen on white
LIMIT: dict[str, Any] = {"color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 2))}
SUBTITLE: dict[str, Any] = {"loc": "left", "fontsize": "medium", "fontweight": "normal"}
VIEW_TITLES = {  # of an NMPC among obstacles that move
    "known": "knows the motion", "extrapolated": "extrapolates", "frozen": "as if they stood",
}  # fmt: skip
VIEW_LINES: dict[str, dict[str, Any]] = {
    "known": {"color": TEAL, "linestyle": "-"},
    "extrapolated": {"color": "#B37A00", "linestyle": (0, (5, 1))},
    "frozen": {"color": WINE, "linestyle": "-."},
}
DECAY_TITLES = {"step": "noise decays per step", "episode": "noise decays per episode"}
SYMBOLS = {  # of paper.THETA_NAMES, between dollar signs
    "x": r"\theta_x",
    "y": r"\theta_y",
    "heading": r"\theta_\varphi",
    "v": r"\theta_v",
    "nu": r"\theta_\nu",
    "x_f": r"\theta_{x_f}",
    "y_f": r"\theta_{y_f}",
    "heading_f": r"\theta_{\varphi_f}",
    "c": r"\theta_c",
}
MEANINGS = {  # of paper.THETA_NAMES, in a word or two
    "x": "place along x",
    "y": "place along y",
    "heading": "heading",
    "v": "speed",
    "nu": "turn rate",
    "x_f": "last place along x",
    "y_f": "last place along y",
    "heading_f": "last heading",
    "c": "clearance",
}
TOLD_APART = ("v", "nu")  # whose symbols look alike where letters are small


def symbol(name: str) -> str:
    """A component of theta as a figure names it, with a word where its symbol needs one."""
    word = f" ({MEANINGS[name]})" if name in TOLD_APART else ""
    return f"${SYMBOLS[name]}${word}"


STEP_PARTS = {  # of a learning step: colour and hatching
    "solves": ("0.2", ""),
    "network": ("0.42", "//"),
    "the rest": ("0.56", "..."),
}


def shades(count: int) -> list[str]:
    """Colours of lines that are in an order, from dark to pale; none is grey or lost on white."""
    return [to_hex(color) for color in colormaps["plasma"](np.linspace(0.0, 0.62, count))]


def line(learner: str) -> dict[str, Any]:
    """How a median is drawn."""
    return {**LOOKS[learner].line, "linewidth": 1.6}


def thin(learner: str) -> dict[str, Any]:
    """How one of several lines of a learner is drawn."""
    return {**LOOKS[learner].line, "linewidth": 1.2, "markersize": 3.5}


def dots(learner: str, **others: Any) -> dict[str, Any]:
    """How single runs are drawn as points."""
    look = LOOKS[learner]
    style = {"color": look.color, "marker": look.marker, "linestyle": "", "markersize": 4}
    return style | others


def hatched(color: str, hatch: str) -> dict[str, Any]:
    """How a part of a bar is drawn: a pale one has an outline."""
    edge = "0.5" if min(to_rgb(color)) > PALE else "white"
    return {"facecolor": color, "hatch": hatch, "edgecolor": edge, "linewidth": 0.5}


def headed(figure: Figure, finding: str) -> Figure:
    """The figure with the finding above all panels, on as many lines as it takes."""
    unbroken = re.sub(r"\$.*?\$", lambda math: math[0].replace(" ", "{}"), finding)
    look: dict[str, Any] = {"ha": "left", "fontsize": 10.5, "fontweight": "bold", "wrap": True}
    figure.suptitle(unbroken, x=0.01, **look)
    return figure


def marked(figure: Figure, mark: str) -> Figure:
    """The figure with a line that says where its runs come from: below, or above its legend."""
    if figure.legends:
        legend = figure.legends[0]
        legend.set_title(fill(mark, MARK), prop=FontProperties(size="small"))
        legend.get_title().set_color("0.35")
        return figure
    figure.supxlabel(mark, x=0.99, ha="right", fontsize="small", color="0.35", wrap=True)
    return figure


def most_moved(change: Vector) -> str:
    """A title: which component moved most, in any run."""
    most = int(np.argmax(change))
    return f"${SYMBOLS[THETA_NAMES[most]]}$ moves most, by up to {change[most]:.2g}"
