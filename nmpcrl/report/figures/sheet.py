"""The sheet that figures are drawn on: as wide as a telephone can still show, on every page.

A function that `page` decorates draws with its look; `subplots` puts at most two panels beside each
other, and the others below.
"""

import re
from base64 import b64encode
from collections.abc import Callable, Sequence
from functools import wraps
from io import BytesIO
from typing import Any, ParamSpec

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

PAGE: dict[Any, Any] = {
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "figure.dpi": 150,
    "font.size": 10.0,  # "small" is 8.3
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "svg.fonttype": "path",  # an image has no fonts but its own, and nobody searches in it
    "svg.hashsalt": "nmpcrl",  # the same figure, the same bytes
}
WIDTH = 5.0  # inches: a page 390 pixels wide shows 10 points as 10 pixels
HEAVY = 300_000  # bytes of an SVG from which on a PNG is shown
TALL = 2.0  # inches of a panel that stands above others, at most
REST = 1.1  # inches of such a figure for what is not a panel
CANVASES = {"svg": FigureCanvasSVG, "png": FigureCanvasAgg}

Parameters = ParamSpec("Parameters")
Panels = Any  # an array of Axes


class Drawn(Figure):
    """A figure that shows itself in a notebook, as an SVG or, where that is heavy, as a PNG."""

    panels: Panels  # rows and columns as they were asked for, wherever they stand
    across = 0  # columns side by side

    @property
    def finding(self) -> str:
        """The title, or those of the panels, in words."""
        titles = [self.get_suptitle()]
        if not titles[0]:
            titles = [axes.get_title(loc="left") for axes in self.axes]
        return in_words("; ".join(filter(None, titles)))

    def written(self, kind: str) -> bytes:
        """The figure as "svg" or "png"; the same figure gives the same bytes."""
        file, options = BytesIO(), {"metadata": {"Date": None}} if kind == "svg" else {}
        with plt.rc_context(PAGE):
            getattr(self._settled(kind), f"print_{kind}")(file, **options)
        return file.getvalue()

    def _ipython_display_(self) -> None:
        svg = self.written("svg")
        shown = {"text/plain": self.finding}
        if len(svg) < HEAVY:
            shown["image/svg+xml"] = svg.decode()
        else:
            shown["image/png"] = b64encode(self.written("png")).decode()
        display(shown, raw=True)  # type: ignore[no-untyped-call]

    def _settled(self, kind: str) -> Any:
        """What draws a file of this kind, on a figure that is laid out.

        The first kind that is written lays it out, for all: `savefig` would do so anew for each.
        """
        engine = self.get_layout_engine()
        if not isinstance(engine, ConstrainedLayoutEngine):
            return CANVASES[kind](self)
        engine.execute(self)
        for axes in self.axes:
            axes.apply_aspect()  # equal scales settle first, and the layout after
        canvas = CANVASES[kind](self)
        engine.execute(self)  # where letters are as wide as they will be: titles wrap
        self.set_layout_engine("none")  # what is laid out stays so
        return canvas


def page(draw: Callable[Parameters, Figure]) -> Callable[Parameters, Figure]:
    """Let a function draw with the look of `PAGE`."""

    @wraps(draw)
    def drawn(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Figure:
        with plt.rc_context(PAGE):
            return _finished(draw(*args, **kwargs))

    return drawn


def subplots(
    rows: int = 1,
    columns: int = 1,
    height: float = 3.2,
    *,
    across: int | None = None,
    rowwise: bool = False,
    tall: float | None = None,
    **options: Any,
) -> tuple[Figure, Any]:
    """A figure and its axes, as `plt.subplots` returns them; further columns stand below.

    Args:
        rows: of panels.
        columns: of panels.
        height: of the figure, if all columns stand side by side [inches].
        across: how many columns do; of more than two an even number has two, an odd one has one.
        rowwise: the panels of a row stay together below each other, not those of a column.
        tall: height of the figure if some stand below others [inches]; from `height` if absent.
        options: of `Figure.subplots`.
    """
    squeeze = options.pop("squeeze", True)
    across = across or (columns if columns < 3 else 2 - columns % 2)
    with plt.rc_context(PAGE):
        figure: Any = plt.figure(FigureClass=Drawn, layout="constrained")
        plt.close(figure)  # a notebook shows it once
        if across < columns:
            shared = {name: options.get(name) for name in ("sharex", "sharey")}
            panels = _below_each_other(figure, (rows, columns, across), shared, rowwise=rowwise)
            stacked = rows * -(-columns // across)
            height = tall or REST + stacked * min(TALL, (height - REST / 2) / rows)
        else:
            panels = figure.subplots(rows, columns, squeeze=False, **options)
    figure.set_size_inches(WIDTH, height)
    figure.panels, figure.across = panels, across
    if not squeeze:
        return figure, panels
    return figure, panels.item() if panels.size == 1 else panels.squeeze()


def mosaic(
    rows: Sequence[Sequence[str]], heights: Sequence[float], height: float
) -> tuple[Figure, dict[str, Axes]]:
    """A figure and its axes by name, as `plt.subplot_mosaic` returns them.

    Args:
        rows: of names; one that stands several times in a row is as much wider.
        heights: of the rows, relative to each other.
        height: of the figure [inches].
    """
    with plt.rc_context(PAGE):
        figure, panels = plt.subplot_mosaic(
            [list(row) for row in rows],
            FigureClass=Drawn,
            figsize=(WIDTH, height),
            layout="constrained",
            height_ratios=heights,
        )
    plt.close(figure)  # a notebook shows it once
    assert isinstance(figure, Drawn)
    figure.panels, figure.across = np.array([[axes] for axes in panels.values()]), 1
    return figure, panels


def in_words(title: str) -> str:
    """A title without LaTeX, to be read aloud: theta_x and a dollar at either end is "theta_x"."""
    return " ".join(re.sub(r"\$(.*?)\$", lambda found: _spoken(found[1]), title).split())


def fitting(labels: list[str], size: float = 10.0) -> int:
    """How many columns of entries a legend with these labels has room for.

    Args:
        labels: of the entries.
        size: of the letters [points].
    """
    entries = [size / 72 * (5 + 0.58 * len(in_words(label))) for label in labels]
    for columns in range(len(entries), 1, -1):
        filled = [max(column) for column in np.array_split(entries, columns)]
        if sum(filled) - 2 * size / 72 <= WIDTH:  # nothing stands after the last
            return columns
    return 1


def _finished(figure: Figure) -> Figure:
    """A drawn figure with titles that wrap, and labels in each row of panels."""
    for axes in figure.axes:
        for title in (axes.title, axes._left_title):  # type: ignore[attr-defined]
            title.set_wrap(True)
    if isinstance(figure, Drawn):
        _label_each_row(figure)
    return figure


def _below_each_other(
    figure: Figure, shape: tuple[int, int, int], shared: dict[str, Any], *, rowwise: bool
) -> Panels:
    """Axes of which `across` columns stand side by side, and the others below them."""
    rows, columns, across = shape
    groups = -(-columns // across)
    grid = figure.add_gridspec(rows * groups, across)
    panels: Panels = np.empty((rows, columns), dtype=object)
    for i, j in np.ndindex(rows, columns):
        first = {"col": panels[0, j], "row": panels[i, 0], True: panels[0, 0]}
        same = {name: first.get(how) for name, how in shared.items()}
        row = i * groups + j // across if rowwise else j // across * rows + i
        panels[i, j] = axes = figure.add_subplot(grid[row, j % across], **same)
        if shared["sharex"] in ("col", True):
            axes.tick_params(labelbottom=i == rows - 1)
        if shared["sharey"] in ("row", True):
            axes.tick_params(labelleft=j % across == 0)
    return panels


def _label_each_row(figure: Drawn) -> None:
    """Panels that stand first in their row have the label that was given to one beside them."""
    for i, j in np.ndindex(figure.panels.shape):
        axes, labelled = figure.panels[i, j], figure.panels[i, 0]
        if j and j % figure.across == 0 and _shares(axes, labelled):
            axes.tick_params(labelleft=True)
            axes.set_ylabel(axes.get_ylabel() or labelled.get_ylabel())


def _shares(axes: Axes, other: Axes) -> bool:
    """Whether two panels have one vertical axis, or are drawn as if they had."""
    hidden = not axes.yaxis.get_tick_params().get("labelleft", True)
    return hidden or axes.get_shared_y_axes().joined(axes, other)


def _spoken(math: str) -> str:
    """LaTeX of a title as words."""
    words = re.sub(r"\\(?:Vert|\|)", "||", math.replace("{}", " "))
    words = re.sub(r"\\[,;:! ]", " ", words).replace(r"\cdot", " times ")
    words = re.sub(r"\\(?:mathrm|text|mathbf|boldsymbol)\b", "", words)
    words = re.sub(r"(?<=\w)\\(?:var)?(?=[a-zA-Z])", " ", words)
    words = re.sub(r"(?<=[_{ ]) ", "", words).replace("=", " = ")
    return re.sub(r"\\(?:var)?|[{}]", "", words)
