"""What keeps a figure from being read: small letters, what leaves the canvas or lies on others."""

from collections.abc import Iterable, Iterator
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from matplotlib.transforms import Bbox

SHOWN = 342  # pixels that a figure is wide on a page 390 wide
LETTERS = 7.5  # pixels, at least
CONTRAST = 3.0  # to white, at least
SLACK = 2.0  # points that boxes may have in common: there is air around the letters


def flaws(figure: Figure) -> list[str]:
    """In sentences, what a reader of the page would trip over."""
    figure.draw_without_rendering()
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    return [
        *(f"{_name(text)} is small" for text in shown if _pixels(text, figure) < LETTERS),
        *(f"{_name(text)} leaves the canvas" for text in _placed(figure) if _outside(text, figure)),
        *(f"{_name(one)} lies on {_name(other)}" for one, other in _on_each_other(figure)),
        *(f"{color} is pale" for axes in figure.axes for color in _pale(axes)),
        *(f"episode {tick:g} is none" for axes in figure.axes for tick in _halves(axes)),
    ]


def contrast(color: object, alpha: float | None = None) -> float:
    """Of a colour, on white, as WCAG 2.2 defines it."""
    red_green_blue = to_rgba(color, alpha)  # type: ignore[arg-type]
    seen = 1 + red_green_blue[3] * (np.array(red_green_blue[:3]) - 1)
    linear = np.where(seen <= 0.04045, seen / 12.92, ((seen + 0.055) / 1.055) ** 2.4)
    return float(1.05 / (linear @ (0.2126, 0.7152, 0.0722) + 0.05))


def _halves(axes: Axes) -> list[float]:
    """Ticks between two episodes."""
    names = [one.get_xlabel() for one in axes.get_shared_x_axes().get_siblings(axes)]
    ticks = axes.get_xticks() if any("episode" in name for name in names) else []
    return [tick for tick in ticks if not float(tick).is_integer()]


def _name(text: Text) -> str:
    return f"'{' '.join(text.get_text().split())}'"


def _pixels(text: Text, figure: Figure) -> float:
    """How high the letters are where the figure is as wide as the page's text."""
    width = figure.get_size_inches()[0]
    return text.get_fontsize() / 72 * SHOWN / width


def _placed(figure: Figure) -> list[Text]:
    """All texts but the labels of ticks that are not drawn."""
    return [text for group in _kinds(figure) for text in group]


def _kinds(figure: Figure) -> Iterator[list[Text]]:
    """Texts that stand beside each other: no two of them may meet."""
    axes = [one for one in figure.axes if one.get_visible()]
    around = (figure._suptitle, figure._supxlabel, figure._supylabel)  # type: ignore[attr-defined]
    legends = [text for legend in figure.legends for text in legend.findobj(Text)]
    titles = [text for one in axes for text in (one.title, one._left_title)]  # type: ignore[attr-defined]
    labels = [one.label for each in axes if each.axison for one in (each.xaxis, each.yaxis)]
    yield _written([*(text for text in around if text), *legends, *titles, *labels])
    for one in axes:
        yield _written(one.texts)
        if one.axison:
            ticks = [text for axis in (one.xaxis, one.yaxis) for text in _tick_labels(axis)]
            yield _written(ticks)


def _tick_labels(axis: object) -> list[Text]:
    scale = axis.get_transform().transform  # type: ignore[attr-defined]
    low, high = sorted(scale(axis.get_view_interval()))  # type: ignore[attr-defined]
    ticks = axis.get_major_ticks()  # type: ignore[attr-defined]
    places = scale(np.array([tick.get_loc() for tick in ticks], float))
    inside = (places >= low - 1e-9 * (high - low)) & (places <= high + 1e-9 * (high - low))
    return [tick.label1 for tick, seen in zip(ticks, inside, strict=True) if seen]


def _written(texts: Iterable[Text]) -> list[Text]:
    return [text for text in texts if text.get_visible() and text.get_text().strip()]


def _box(text: Text) -> Bbox:
    return Text.get_window_extent(text)  # of the words, without the arrow of an annotation


def _outside(text: Text, figure: Figure) -> bool:
    box, slack = _box(text), SLACK * figure.dpi / 72
    canvas = figure.bbox
    return bool(
        box.x0 < canvas.x0 - slack
        or box.x1 > canvas.x1 + slack
        or box.y0 < canvas.y0 - slack
        or box.y1 > canvas.y1 + slack
    )


def _on_each_other(figure: Figure) -> Iterator[tuple[Text, Text]]:
    slack = SLACK * figure.dpi / 72
    for group in _kinds(figure):
        for one, other in combinations(group, 2):
            a, b = _box(one), _box(other)
            wide = min(a.x1, b.x1) - max(a.x0, b.x0)
            high = min(a.y1, b.y1) - max(a.y0, b.y0)
            if min(wide, high) > slack and one.get_text() != other.get_text():
                yield one, other


def _pale(axes: Axes) -> set[str]:
    """Colours that are hard to see on white, wherever a panel has them.

    A colour may be faint where the same one stands out: single runs behind their median.
    """
    lines = [line for line in axes.get_lines() if _drawn(line)]
    bars = [patch for patch in axes.patches if isinstance(patch, Rectangle) and patch.get_height()]
    seen: dict[str, float] = {}
    for line in lines:
        color = str(line.get_color())
        seen[color] = max(seen.get(color, 0.0), contrast(line.get_color(), line.get_alpha()))
    for bar in bars:
        edge = bar.get_edgecolor() if bar.get_linewidth() else "white"
        color = str(bar.get_facecolor())
        seen[color] = max(contrast(bar.get_facecolor()), contrast(edge))
    return {color for color, best in seen.items() if best < CONTRAST}


def _drawn(line: Line2D) -> bool:
    return line.get_visible() and line.get_color() != "white" and len(line.get_xydata()) > 0
