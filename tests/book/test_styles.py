"""The book's colours can be read in both themes, on a screen and on paper."""

import re
from pathlib import Path

import pytest
from legibility import contrast
from matplotlib.colors import rgb_to_hsv, to_rgb

from nmpcrl.report.figures.style import INK, LOOKS, QUIET, TEAL, WINE

STYLES = (Path(__file__).resolve().parents[2] / "book/_static/nmpcrl.css").read_text()
LINE = 3.0  # the contrast that WCAG 2.2 AA asks of what is drawn
OPPOSITE = ((-0.574, 1.43, 0.144), (0.426, 0.43, 0.144), (0.426, 1.43, -0.856))  # hues by 180 deg


def in_the_dark(colour: str) -> list[float]:
    """What the filter of the dark theme makes of a colour of a figure."""
    found = re.search(r"filter: invert\(([\d.]+)\) hue-rotate\(180deg\);", STYLES)
    by = float(found[1])
    inverted = [by + (1 - 2 * by) * part for part in to_rgb(colour)]
    turned = [sum(w * c for w, c in zip(row, inverted, strict=True)) for row in OPPOSITE]
    return [min(max(part, 0.0), 1.0) for part in turned]


@pytest.mark.parametrize("colour", [*(one.color for one in LOOKS.values()), INK, QUIET, TEAL, WINE])
def test_a_line_of_a_figure_stands_out_from_the_dark_ground_and_keeps_its_hue(colour):
    shown, ground = in_the_dark(colour), in_the_dark("#ffffff")
    assert contrast(ground) > 15
    assert contrast(ground) / contrast(shown) >= LINE
    before, after = (rgb_to_hsv(rgb)[0] for rgb in (to_rgb(colour), shown))
    if max(to_rgb(colour)) > min(to_rgb(colour)):  # grey has no hue
        assert abs((before - after + 0.5) % 1 - 0.5) < 0.06


def test_a_figure_is_dark_on_a_screen_alone():
    assert STYLES.count("filter: invert") == 1
    assert re.search(r"@media screen \{\n  html\[data-theme=\"dark\"\] \.bd-article img \{", STYLES)
