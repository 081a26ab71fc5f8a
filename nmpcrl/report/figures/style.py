"""What all figures share: the look of each learner, of a line and of a page."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from nmpcrl import Vector
from nmpcrl.study.paper import THETA_NAMES

WIDTH = 7.0  # inches; the book shows figures as wide as its text

PAGE: dict[Any, Any] = {
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "figure.dpi": 150,
    "font.size": 9.5,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
}

Parameters = ParamSpec("Parameters")


def page(draw: Callable[Parameters, Figure]) -> Callable[Parameters, Figure]:
    """Let a function draw with the look of `PAGE`."""

    @wraps(draw)
    def drawn(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Figure:
        with plt.rc_context(PAGE):
            return draw(*args, **kwargs)

    return drawn


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
    "TDC": Look("#CC79A7", (0, (4, 1, 1, 1, 1, 1)), "v"),
    "QL": Look("#56B4E9", (0, (8, 3)), "P"),
    "frozen": Look("#8A8A8A", ":", "x"),
    "matched": Look("#E69F00", (0, (2, 1)), "<"),
    "random": Look("#8C5A2B", (0, (1, 1)), ">"),
}

INK, TEAL, WINE = "0.25", "#1B7F79", "#882255"  # none of them is a learner's
LIMIT: dict[str, Any] = {"color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 2))}
SUBTITLE: dict[str, Any] = {"loc": "left", "fontsize": "medium", "fontweight": "normal"}
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
STEP_PARTS = {  # of a learning step: colour and hatching
    "solves": ("#0072B2", ""),
    "network": ("#E69F00", "//"),
    "the rest": ("0.8", ""),
}


def line(learner: str) -> dict[str, Any]:
    """How a median is drawn."""
    return {**LOOKS[learner].line, "linewidth": 1.6}


def thin(learner: str) -> dict[str, Any]:
    """How one of several lines of a learner is drawn."""
    return {**LOOKS[learner].line, "linewidth": 1.2, "markersize": 3.5, "alpha": 0.85}


def dots(learner: str, **others: Any) -> dict[str, Any]:
    """How single runs are drawn as points."""
    look = LOOKS[learner]
    style = {"color": look.color, "marker": look.marker, "linestyle": "", "markersize": 4}
    return style | others


def hatched(color: str, hatch: str) -> dict[str, Any]:
    """How a part of a bar is drawn."""
    return {"facecolor": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.5}


def headed(figure: Figure, finding: str) -> Figure:
    """The figure with the finding above all panels."""
    figure.suptitle(finding, x=0.01, ha="left", fontsize=10.5, fontweight="bold")
    return figure


def marked(figure: Figure, mark: str) -> Figure:
    """The figure with a line below that says where its runs come from."""
    figure.supxlabel(mark, x=0.99, ha="right", fontsize="x-small", color="0.35")
    return figure


def subplots(
    rows: int = 1, columns: int = 1, height: float = 3.2, **options: Any
) -> tuple[Figure, Any]:
    """A figure of the page's width and its axes; closed, so that a notebook shows it once."""
    with plt.rc_context(PAGE):
        figure, axes = plt.subplots(
            rows, columns, figsize=(WIDTH, height), layout="constrained", **options
        )
    plt.close(figure)
    return figure, axes


def most_moved(change: Vector) -> str:
    """A title: which component moved most, in any run."""
    most = int(np.argmax(change))
    return f"${SYMBOLS[THETA_NAMES[most]]}$ moves most, by up to {change[most]:.2g}"
