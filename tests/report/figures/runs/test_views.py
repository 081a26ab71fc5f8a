"""Robots among obstacles that move: the title counts, and the SVG plays at #play."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from nmpcrl.analysis.encounters import Contacts, Encounters
from nmpcrl.report.figures.moving import PLAY, SECONDS
from nmpcrl.report.figures.runs import views as figures
from nmpcrl.report.figures.sheet import NARROW, WIDE
from nmpcrl.studies.worlds import VIEWS
from nmpcrl.study import paper
from nmpcrl.study.moving import Straight, centres

SVG = "{http://www.w3.org/2000/svg}"
MOTIONS = (Straight((3.0, 3.0), (0.0, -0.1)), Straight((5.0, 1.0), (0.1, 0.0)))
INSIDE = dict(zip(VIEWS, (0, 7, 24), strict=True))


@pytest.fixture(scope="module")
def figure():
    way = np.linspace([-2.5, 1.5, 0.0], [8.5, 2.0, 0.0], paper.STEPS + 1)
    return figures.views(
        MOTIONS, {view: Encounters(way, 4000.0, Contacts(n, 1), True) for view, n in INSIDE.items()}
    )


def test_the_title_counts_the_states_inside(figure):
    assert [int(n) for n in re.findall(r"\d+", figure.finding)] == [*INSIDE.values()]


@pytest.mark.parametrize("on", [WIDE, NARROW], ids=["wide", "narrow"])
def test_all_that_moves_has_a_way_of_its_own_that_plays_only_where_it_is_asked_for(figure, on):
    drawn = figure.again(on)
    svg = drawn.written("svg").decode()
    root = ET.fromstring(svg)
    assert root.get("id") == PLAY
    groups = {one.get("id") for one in root.iter(f"{SVG}g")}
    style = "".join(one.text for one in root.iter(f"{SVG}style"))
    assert len(drawn.ways) == len(VIEWS) * (len(MOTIONS) + 2)  # discs, robot, and dot of each view
    for way in drawn.ways:
        name = way.artist.get_gid()
        assert name in groups
        assert f"svg:target #{name}{{animation:{name} {SECONDS:g}s linear infinite}}" in style
    assert "animation" not in style.replace("svg:target #way", "")[: style.index("svg:target #way")]


def test_a_disc_moves_as_far_in_the_picture_as_its_obstacle_does_on_the_map(figure):
    figure.written("svg")
    disc = figure.ways[0]
    frames = re.findall(
        r"([\d.]+)%\{transform:translate\(([-\d.]+)px,([-\d.]+)px\)\}", disc.rules()
    )
    percent, x, y = np.array(frames, float).T
    assert (percent[0], percent[-1], len(percent)) == (0, 100, paper.STEPS)
    at = centres(MOTIONS, np.arange(paper.STEPS))[:, 0]
    scale = (
        np.diff(disc.axes.transData.transform([[0.0, 0.0], [0.0, 1.0]])[:, 1])[0] * 72 / figure.dpi
    )
    assert x[disc.stands] == y[disc.stands] == 0
    moved = (at - at[disc.stands]) * [scale, -scale]
    assert np.c_[x, y] == pytest.approx(moved, abs=0.051)


def test_what_leaves_its_map_is_cut_off_by_a_window_that_stands(figure):
    root = ET.fromstring(figure.written("svg").decode())
    parents = {child: parent for parent in root.iter() for child in parent}
    discs = [one for one in root.iter(f"{SVG}g") if one.get("id") == "way0"]
    assert len(discs) == 1
    assert parents[discs[0]].get("clip-path", "").startswith("url(#")
    assert not any(one.get("clip-path") for one in discs[0].iter())


def test_what_has_no_way_does_not_play(figure):
    still = figure.again(WIDE)
    still.ways.clear()
    assert b"<style>\n" not in still.written("svg")
