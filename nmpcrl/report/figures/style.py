"""What all figures share: the page that they are drawn on, and the look of a learner and a line."""

import re
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from io import BytesIO
from textwrap import fill
from typing import Any, ParamSpec

import numpy as np
from IPython.display import display
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties

PAGE: dict[Any, Any] = {
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": "medium",
    "figure.dpi": 150,
    "figure.titlesize": 10.5,
    "figure.titleweight": "bold",
    "font.size": 10.0,  # "small" is 8.3
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "svg.fonttype": "path",  # an image has no fonts but its own, and nobody searches in it
    "svg.hashsalt": "nmpcrl",  # the same figure, the same bytes
}
WIDTH = 5.0  # inches: a page 390 pixels wide shows 10 points as 10 pixels
HEAVY = 300_000  # bytes of an SVG from which on there is only a PNG

Parameters = ParamSpec("Parameters")


class Drawn(Figure):
    """A figure of the page's width that shows itself as a PNG and, unless heavy, as an SVG.

    A page takes the SVG. JupyterLab shows none of a notebook that it has not run itself.
    """

    def __init__(self, height: float) -> None:
        super().__init__(figsize=(WIDTH, height), layout="constrained")

    @property
    def finding(self) -> str:
        """The title in words."""
        return in_words(self.get_suptitle())

    def written(self, kind: str) -> bytes:
        """The figure as "svg" or "png"; the same figure gives the same bytes."""
        file, about = BytesIO(), {"Date": None} if kind == "svg" else None
        with rc_context(PAGE):
            self.draw_without_rendering()  # titles wrap, and the layout has room for them
            self.savefig(file, format=kind, metadata=about)
        return file.getvalue()

    def _ipython_display_(self) -> None:
        svg, png = self.written("svg"), b64encode(self.written("png")).decode()
        shown = {"text/plain": self.finding, "image/png": png}
        if len(svg) < HEAVY:
            shown["image/svg+xml"] = svg.decode()
        display(shown, raw=True)  # type: ignore[no-untyped-call]


def page(draw: Callable[Parameters, Drawn]) -> Callable[Parameters, Drawn]:
    """Let a function draw with the look of `PAGE`."""

    @wraps(draw)
    def drawn(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Drawn:
        with rc_context(PAGE):
            return draw(*args, **kwargs)

    return drawn


def subplots(
    rows: int = 1, columns: int = 1, height: float = 3.2, **options: Any
) -> tuple[Drawn, Any]:
    """A figure of a height [inches] and its axes, as `Figure.subplots` returns them."""
    figure = Drawn(height)
    return figure, figure.subplots(rows, columns, **options)


def titled(figure: Drawn, title: str, source: str = "", legend: Axes | Sequence[Any] = ()) -> Drawn:
    """The figure with its finding above, on as many lines as it takes, and its legend below.

    Args:
        figure: all panels.
        title: the finding.
        source: where the runs come from; it heads the legend, if there is one.
        legend: its handles, or a panel with all of them; in as many columns as there is room for.
    """
    unbroken = re.sub(r"\$.*?\$", lambda math: math[0].replace(" ", "{}"), title)
    figure.suptitle(unbroken, x=0.01, ha="left", wrap=True)
    handles = legend.get_legend_handles_labels()[0] if isinstance(legend, Axes) else legend
    if handles:
        names = [str(one.get_label()) for one in handles]
        plain = (re.sub(r"[${}_^]", "", re.sub(r"\\[a-zA-Z]+", "x", name)) for name in names)
        widest = 4.8 + 0.56 * max(map(len, plain))  # in letters of 10 points, with its line
        columns = max(1, int((7.2 * WIDTH + 2) / widest))  # nothing stands after the last
        place: dict[str, Any] = {"loc": "outside lower left", "alignment": "left"}
        box = figure.legend(handles, names, ncols=columns, **place)
        box.set_title(fill(source, 78), prop=FontProperties(size="small"))
        box.get_title().set_color("0.35")
    elif source:
        figure.supxlabel(source, x=0.99, ha="right", fontsize="small", color="0.35", wrap=True)
    return figure


def in_words(title: str) -> str:
    """A title without LaTeX, to be read aloud: theta_x and a dollar at either end is "theta_x"."""
    return " ".join(re.sub(r"\\mathrm|\\var|[$\\{}]", "", title.replace("{}", " ")).split())


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

    def dots(self, **others: Any) -> dict[str, Any]:
        """Keyword arguments of single runs as points."""
        look = {"color": self.color, "marker": self.marker, "linestyle": "", "markersize": 4}
        return look | others


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

INK, TEAL, WINE, OCHRE = "0.25", "#1B7F79", "#882255", "#B37A00"  # none is a learner's of the paper
QUIET = "0.55"  # the grey of what only stands behind
AT_ONE: dict[str, Any] = {"color": "0.5", "linewidth": 0.9}  # what a ratio is compared to
BAND: dict[str, Any] = {"facecolor": "0.92", "edgecolor": "0.5", "linewidth": 0.6, "zorder": 0}
LIMIT: dict[str, Any] = {"color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 2))}
DECAY_TITLES = {"step": "noise decays per step", "episode": "noise decays per episode"}
MEANINGS = {  # of paper.THETA_NAMES: the symbol, and a word or two
    "x": (r"$\theta_x$", "place along x"),
    "y": (r"$\theta_y$", "place along y"),
    "heading": (r"$\theta_\varphi$", "heading"),
    "v": (r"$\theta_v$", "speed"),
    "nu": (r"$\theta_\nu$", "turn rate"),
    "x_f": (r"$\theta_{x_f}$", "last place along x"),
    "y_f": (r"$\theta_{y_f}$", "last place along y"),
    "heading_f": (r"$\theta_{\varphi_f}$", "last heading"),
    "c": (r"$\theta_c$", "clearance"),
}


def shades(count: int) -> list[str]:
    """Colours of lines that are in an order, from dark to pale; none is grey or lost on white."""
    return [to_hex(color) for color in colormaps["plasma"](np.linspace(0.0, 0.62, count))]
