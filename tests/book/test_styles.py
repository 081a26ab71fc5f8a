"""The book's colours can be read in both themes, on a screen and on paper."""

import re
from pathlib import Path

import pytest
from matplotlib.colors import to_rgb

from nmpcrl.report.tables import BADGES

STYLES = (Path(__file__).resolve().parents[2] / "book/_static/nmpcrl.css").read_text()
LEAST = 4.5  # the contrast that WCAG 2.2 AA asks for


def colours(theme: str) -> dict[str, str]:
    """The colours of verdicts in a theme, by name; what only one theme sets is that theme's."""
    blocks = (r":root", rf'html\[data-theme="{theme}"\]')
    found = [re.search(rf"^{one} \{{(.*?)\}}", STYLES, flags=re.M | re.S)[1] for one in blocks]
    return dict(re.findall(r"--(verdict-[\w-]+): (#\w{6});", "".join(found)))


def luminance(colour: str) -> float:
    parts = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), parts, strict=True))


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_badge_has_a_colour_of_its_own_on_which_its_words_can_be_read(theme):
    found = colours(theme)
    ink = luminance(found.pop("verdict-ink"))
    assert set(found) == set(BADGES.values())
    assert len(set(found.values())) == len(found)
    for name, colour in found.items():
        low, high = sorted((ink, luminance(colour)))
        assert (high + 0.05) / (low + 0.05) >= LEAST, name
        assert f".{name} {{ background: var(--{name}); }}" in STYLES


def test_the_dark_ink_would_not_be_read_on_the_light_themes_badges():
    ink, badge = (
        luminance(colours(theme)[name])
        for theme, name in (("dark", "verdict-ink"), ("light", "verdict-not-applicable"))
    )
    assert (badge + 0.05) / (ink + 0.05) < LEAST
