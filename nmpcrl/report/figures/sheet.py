"""What a figure is drawn on, wide or narrow or low, and how a notebook shows it.

A function that `page` decorates draws on a sheet as wide as the book's text. The figure that it
returns can call it again for a narrow one, whose panels stand below each other: for a telephone;
and, if it is too high for that, for one as low as a slide is.
"""

import os
import re
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial, wraps
from io import BytesIO
from typing import Any, ParamSpec

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from nmpcrl import Matrix
from nmpcrl.report.figures.moving import Way, playing

PAGE: dict[Any, Any] = {
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "figure.dpi": 150,
    "font.size": 9.6,  # "small" is 8
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "pdf.fonttype": 42,  # letters stay letters where a PDF is edited
    "svg.fonttype": "path",  # an image has no fonts but its own, and nobody searches in it
    "svg.hashsalt": "nmpcrl",  # the same figure, the same bytes
}
MIME = "application/vnd.nmpcrl.figure+json"  # what the book's page shows, beside "image/png"
FOR_PAGE = "NMPCRL_FIGURES_FOR_PAGE"  # set where `MIME` is wanted, too: it takes time and room
HEAVY = 300_000  # bytes of an SVG from which on a page shows a PNG
SHARP = 216  # dots an inch of a narrow PNG: telephones show several where a page counts one
TALL = 2.0  # inches of a panel that stands above others, at most
REST = 1.1  # inches of a narrow figure for what is not a panel
CANVASES = {"svg": FigureCanvasSVG, "pdf": FigureCanvasPdf, "png": FigureCanvasAgg}
DATES = {"svg": "Date", "pdf": "CreationDate"}  # what a file would say of when it was made

Parameters = ParamSpec("Parameters")
Panels = Any  # an array of Axes


@dataclass(frozen=True)
class Sheet:
    """What a figure is drawn on."""

    width: float  # inches
    narrow: bool = False
    height: float = np.inf  # inches, at most

    @property
    def low(self) -> bool:
        """Whether there is no room for many rows."""
        return bool(np.isfinite(self.height))


WIDE, NARROW = Sheet(7.0), Sheet(3.6, narrow=True)
SLIDE = Sheet(7.0, height=3.6)  # on 1280 pixels, "small" letters are 20 of them
_open: ContextVar[Sheet | None] = ContextVar("sheet", default=None)


def sheet() -> Sheet:
    """What is being drawn on."""
    return _open.get() or WIDE


class TooHeavy(Exception):
    """A file has too many bytes."""


class Limited(BytesIO):
    """A file that takes no more than so many bytes."""

    def __init__(self, most: float) -> None:
        super().__init__()
        self._most = most

    def write(self, data: Any) -> int:
        written = super().write(data)
        if self.tell() >= self._most:
            raise TooHeavy
        return written


class Drawn(Figure):
    """A figure that can be drawn once more on another sheet, and shows itself."""

    again: Callable[[Sheet], Figure] | None = None
    panels: Panels  # rows and columns as they were asked for, wherever they stand
    across = 0  # columns side by side

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        """As a `Figure` begins; nothing of it moves."""
        super().__init__(*args, **kwargs)
        self.ways: list[Way] = []

    def moves(self, axes: Axes, artist: Artist, points: Matrix, stands: int) -> None:
        """Let an artist play through a way.

        Args:
            axes: whose data the way is in.
            artist: drawn at `points[stands]`.
            points: shape (K, 2), at equal distances in time.
            stands: see above.
        """
        artist.set_gid(f"way{len(self.ways)}")
        self.ways.append(Way(artist, axes, points, stands))

    @property
    def finding(self) -> str:
        """The title, or those of the panels, in words."""
        titles = [self.get_suptitle()]
        if not titles[0]:
            titles = [axes.get_title(loc="left") for axes in self.axes]
        return in_words("; ".join(filter(None, titles)))

    def written(self, kind: str, most: float = np.inf) -> bytes:
        """The figure as "svg", "pdf" or "png"; the same figure gives the same bytes.

        Raises:
            TooHeavy: it has `most` bytes or more, and is not written to its end.
        """
        file = Limited(most)
        options: dict[str, Any] = {"metadata": {DATES[kind]: None}} if kind in DATES else {}
        with plt.rc_context(PAGE), self._dots():
            canvas = self._settled(kind)
            if kind == "png" and self.get_figwidth() <= NARROW.width:
                self.set_dpi(SHARP)
            getattr(canvas, f"print_{kind}")(file, **options)
        data = file.getvalue()
        if kind == "svg" and self.ways:
            return playing(data.decode(), self.ways).encode()
        return data

    def _ipython_display_(self) -> None:
        shown: dict[str, Any] = {"text/plain": self.finding, "image/png": self._png()}
        if FOR_PAGE in os.environ:
            shown[MIME] = {"finding": self.finding, "wide": self._file()}
            shown[MIME]["plays"] = bool(self.ways)
            shown[MIME]["pdf"] = b64encode(self.written("pdf")).decode()
            if self.again is not None:
                shown[MIME]["narrow"] = self._on(NARROW)
                if self.get_figheight() > SLIDE.height:
                    shown[MIME]["slide"] = self._on(SLIDE)
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

    @contextmanager
    def _dots(self) -> Iterator[None]:
        """However many an inch a file has, there are as many as before after it."""
        before = self.get_dpi()
        try:
            yield
        finally:
            self.set_dpi(before)

    def _on(self, other: Sheet) -> dict[str, Any]:
        """The file of the figure on another sheet: SVG, or PNG where that is heavy."""
        assert self.again
        drawn = self.again(other)
        assert isinstance(drawn, Drawn)
        try:
            return drawn._size() | {"svg": drawn.written("svg", HEAVY).decode()}
        except TooHeavy:
            return drawn._size() | {"png": drawn._png()}

    def _file(self) -> dict[str, Any]:
        """The size of the figure, and its SVG, light or "heavy"."""
        svg = self.written("svg")
        return self._size() | {"svg" if len(svg) < HEAVY else "heavy": svg.decode()}

    def _size(self) -> dict[str, int]:
        """Width and height in a browser's pixels."""
        width, height = np.round(96 * self.get_size_inches()).astype(int).tolist()
        return {"width": width, "height": height}

    def _png(self) -> str:
        return b64encode(self.written("png")).decode()


def page(draw: Callable[Parameters, Figure]) -> Callable[Parameters, Figure]:
    """Let a function draw with the look of `PAGE`, and its figure be drawn again.

    What it is given is kept for that, and must not be changed or used up.
    """

    @wraps(draw)
    def drawn(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Figure:
        if _open.get():  # a part of another figure
            return draw(*args, **kwargs)
        on = partial(_drawn_on, draw=partial(draw, *args, **kwargs))
        figure = on(WIDE)
        if isinstance(figure, Drawn):
            figure.again = on
        return figure

    return drawn


def subplots(
    rows: int = 1,
    columns: int = 1,
    height: float = 3.2,
    *,
    across: int = 1,
    rowwise: bool = False,
    tall: float | None = None,
    **options: Any,
) -> tuple[Figure, Any]:
    """A figure as wide as the sheet, and its axes as `plt.subplots` returns them.

    On a narrow sheet the columns of panels stand below each other, `across` of them side by side.
    On a low one they are lower.

    Args:
        rows: of panels.
        columns: of panels.
        height: of the figure on a wide sheet [inches].
        across: how many columns stand side by side on a narrow sheet.
        rowwise: the panels of a row stay together on a narrow sheet, not those of a column.
        tall: height of the figure on a narrow sheet [inches]; from `height` if absent.
        options: of `Figure.subplots`.
    """
    narrow, squeeze = sheet().narrow, options.pop("squeeze", True)
    with plt.rc_context(PAGE):
        figure: Any = plt.figure(FigureClass=Drawn, layout="constrained")
        plt.close(figure)  # a notebook shows it once
        if narrow:
            shared = {name: options.get(name) for name in ("sharex", "sharey")}
            panels = _below_each_other(figure, (rows, columns, across), shared, rowwise=rowwise)
        else:
            across = columns
            panels = figure.subplots(rows, columns, squeeze=False, **options)
    if narrow:
        stacked = rows * -(-columns // across)
        height = tall or REST + stacked * min(TALL, (height - REST / 2) / rows)
    figure.set_size_inches(sheet().width, min(height, sheet().height))
    figure.panels, figure.across = panels, across
    if not squeeze:
        return figure, panels
    return figure, panels.item() if panels.size == 1 else panels.squeeze()


def mosaic(
    rows: Sequence[Sequence[str]], heights: Sequence[float], height: float, tall: Sequence[float]
) -> tuple[Figure, dict[str, Axes]]:
    """A figure as wide as the sheet, and its axes by name, as `plt.subplot_mosaic` returns them.

    On a narrow sheet they stand below each other in the order in which they are read.

    Args:
        rows: of names; one that stands several times in a row is as much wider.
        heights: of the rows on a wide sheet, relative to each other.
        height: of the figure on a wide sheet [inches].
        tall: heights of the panels on a narrow sheet [inches].
    """
    if sheet().narrow:
        rows = [(name,) for name in dict.fromkeys(name for row in rows for name in row)]
        heights, height = tall, REST + sum(tall)
    with plt.rc_context(PAGE):
        figure, panels = plt.subplot_mosaic(
            [list(row) for row in rows],
            FigureClass=Drawn,
            figsize=(sheet().width, height),
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


def fitting(labels: list[str], size: float = 9.6) -> int:
    """How many columns of entries a legend with these labels has room for on the sheet.

    Args:
        labels: of the entries.
        size: of the letters [points].
    """
    entries = [size / 72 * (5 + 0.58 * len(in_words(label))) for label in labels]
    for columns in range(len(entries), 1, -1):
        filled = [max(column) for column in np.array_split(entries, columns)]
        if sum(filled) - 2 * size / 72 <= sheet().width:  # nothing stands after the last
            return columns
    return 1


def _drawn_on(on: Sheet, draw: Callable[[], Figure]) -> Figure:
    """The figure of a function, on a sheet."""
    with plt.rc_context(PAGE), _opened(on):
        figure = draw()
        for axes in figure.axes:
            for title in (axes.title, axes._left_title):  # type: ignore[attr-defined]
                title.set_wrap(True)
        if isinstance(figure, Drawn) and on.narrow:
            _label_each_row(figure)
    return figure


@contextmanager
def _opened(on: Sheet) -> Iterator[None]:
    before = _open.set(on)
    try:
        yield
    finally:
        _open.reset(before)


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
