"""What keeps a figure from being read: small letters, what leaves the canvas or lies on others."""

from collections.abc import Iterable, Iterator
from itertools import combinations

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.text import Text

SHOWN = 342  # pixels that a figure is wide on a page 390 wide
LETTERS = 7.5  # pixels, at least
SLACK = 2.0  # points that boxes may have in common: there is air around the letters


def flaws(figure: Figure) -> list[str]:
    """In sentences, what a reader of the page would trip over."""
    figure.draw_without_rendering()
    small = LETTERS * 72 / SHOWN * figure.get_size_inches()[0]
    slack = SLACK * figure.dpi / 72
    found = []
    for group in _kinds(figure):
        texts = [text for text in group if text.get_visible() and text.get_text().strip()]
        boxes = [Text.get_window_extent(text) for text in texts]  # without an annotation's arrow
        names = [f"'{' '.join(text.get_text().split())}'" for text in texts]
        for text, name, box in zip(texts, names, boxes, strict=True):
            if text.get_fontsize() < small:
                found.append(f"{name} is small")
            if box.x0 < -slack or box.y0 < -slack or (box.max > figure.bbox.max + slack).any():
                found.append(f"{name} leaves the canvas")
        for (i, a), (j, b) in combinations(enumerate(boxes), 2):
            wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
            if min(wide, high) > slack and names[i] != names[j]:
                found.append(f"{names[i]} lies on {names[j]}")
    return found


def contrast(color: object) -> float:
    """Of a colour, on white, as WCAG 2.2 defines it."""
    seen = np.array(to_rgba(color)[:3])  # type: ignore[arg-type]
    linear = np.where(seen <= 0.04045, seen / 12.92, ((seen + 0.055) / 1.055) ** 2.4)
    return float(1.05 / (linear @ (0.2126, 0.7152, 0.0722) + 0.05))


def _kinds(figure: Figure) -> Iterator[list[Text]]:
    """Texts that stand beside each other: no two of them may meet."""
    axes = [one for one in figure.axes if one.get_visible()]
    around = (figure._suptitle, figure._supxlabel, figure._supylabel)  # type: ignore[attr-defined]
    legends = [text for legend in figure.legends for text in legend.findobj(Text)]
    titles = [one._left_title for one in axes]  # type: ignore[attr-defined]
    labels = [one.label for each in axes if each.axison for one in (each.xaxis, each.yaxis)]
    yield [*filter(None, around), *legends, *titles, *labels]
    for one in axes:
        yield one.texts
        if one.axison:
            yield [text for axis in (one.xaxis, one.yaxis) for text in _tick_labels(axis)]


def _tick_labels(axis: object) -> Iterable[Text]:
    """The labels of the ticks within the axis."""
    scale = axis.get_transform().transform  # type: ignore[attr-defined]
    low, high = sorted(scale(axis.get_view_interval()))  # type: ignore[attr-defined]
    for tick in axis.get_major_ticks():  # type: ignore[attr-defined]
        if low - 1e-9 <= scale(np.array([tick.get_loc()], float))[0] <= high + 1e-9:
            yield tick.label1
