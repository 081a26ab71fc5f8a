"""What all figures share: the look of each learner, and the look of the page."""

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

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

page: Any = plt.rc_context(PAGE)  # as a decorator; matplotlib's types do not know that it is one


@dataclass(frozen=True)
class Look:
    """How a learner is drawn, everywhere; told apart in grey and by the colour-blind."""

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
