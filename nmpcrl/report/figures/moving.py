"""An SVG that is still, and plays where its address ends in #play.

No script is needed: a style sheet moves the groups of those artists that have a way. The book's
page puts #play behind the address when the figure is clicked.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from nmpcrl import Matrix

PLAY = "play"  # what the address ends in
SECONDS = 13.0  # that all ways take

# A disc that moves through a window is cut off where the window ends, which does not move with it.
CLIPPED = re.compile(r'<g id="(way\d+)">(\s*<path [^>]*?)(clip-path="[^"]*")([^>]*/>\s*)</g>')


@dataclass(frozen=True, eq=False)
class Way:
    """Where an artist is as time goes by."""

    artist: Artist  # whose id is its own
    axes: Axes
    points: Matrix  # in data of the axes, shape (K, 2), at equal distances in time
    stands: int  # number of the point at which it is drawn

    def rules(self) -> str:
        """The way in a style sheet, in the points of an SVG, where y points down."""
        shown = self.axes.transData.transform(self.points) * 72 / self.axes.figure.dpi
        moved = np.round((shown - shown[self.stands]) * [1, -1], 1) + 0.0
        name, last = self.artist.get_gid(), len(moved) - 1
        frames = [
            f"{100 * k / last:.4g}%{{transform:translate({x:g}px,{y:g}px)}}"
            for k, (x, y) in enumerate(moved.tolist())
        ]
        return (
            f"@keyframes {name}{{{''.join(frames)}}}\n"
            f"svg:target #{name}{{animation:{name} {SECONDS:g}s linear infinite}}"
        )


def playing(svg: str, ways: Sequence[Way]) -> str:
    """The SVG of a figure whose layout is settled, with the ways of its artists."""
    style = "\n".join(way.rules() for way in ways)
    svg = CLIPPED.sub(r'<g \3><g id="\1">\2\4</g></g>', svg)
    head, rest = svg.split("<svg ", 1)
    opened, rest = rest.split(">", 1)
    return f'{head}<svg id="{PLAY}" {opened}>\n<style>\n{style}\n</style>{rest}'
