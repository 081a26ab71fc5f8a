"""Layouts and poses: one word for the same centres, and refusals of what no solver is given."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.control.solvers.charge import DISCS
from nmpcrl.study import ParameterError, paper
from nmpcrl.study.geometry import MOST_OBSTACLES, Layout, Pose, are_centres, short_name

LAYOUT = Layout(paper.LAYOUTS)
POSE = Pose(paper.LOWER, paper.UPPER)
numbers = st.floats(-100, 100)
layouts = st.lists(st.tuples(numbers, numbers), min_size=1, max_size=16)


@given(layouts)
def test_a_layout_is_one_word_that_gives_its_centres_back_to_the_last_bit(centres):
    word = LAYOUT.check("layout", centres)
    assert isinstance(word, str)
    assert list(LAYOUT.centres(word)) == centres
    assert LAYOUT.check("layout", word) == LAYOUT.check("layout", np.array(centres)) == word
    assert "-0," not in f"{word},".replace("-0.", "").replace(" ", ",")


@given(layouts, st.sampled_from([",", " ", "  ", ", "]))
def test_it_does_not_matter_how_numbers_are_separated(centres, between):
    word = LAYOUT.check("layout", centres)
    assert LAYOUT.check("layout", word.replace(" ", between)) == word


def test_the_browser_has_room_for_every_layout():
    assert MOST_OBSTACLES == DISCS


def test_a_layout_without_obstacles_or_with_too_many_is_refused():
    assert len(LAYOUT.centres([(1, 2)] * 16)) == 16
    for centres in ([], [(1, 2)] * 17, "", "1,2 " * 17):
        with pytest.raises(ParameterError, match=r"layout = .* must be one of A, B"):
            LAYOUT.centres(centres)


def test_a_short_name_is_the_layouts_own_or_fits_a_file():
    assert short_name("A") == "A"
    word = LAYOUT.check("layout", [(0.1 * i, 1 / 3) for i in range(16)])
    assert len(short_name(word)) == len("drawn-123456")
    assert short_name(word) != short_name(word.replace("0.1,", "0.2,"))


@pytest.mark.parametrize(
    ("value", "are"),
    [
        ([(0, 1)], True),
        (np.zeros((2, 2)), True),
        (["A", "B"], False),
        ([[(0, 1)], [(1, 2)]], False),
        (["A", [(0, 1)]], False),
        ([], False),
        ("A", False),
        (3, False),
    ],
)
def test_the_centres_of_one_layout_are_told_from_several_layouts(value, are):
    assert are_centres(value) == are


def test_a_pose_is_in_the_box_walls_included():
    assert POSE.check("start", [-3, 9, -math.tau]) == (-3.0, 9.0, -math.tau)
    assert math.copysign(1, POSE.check("start", [-0.0, 0, 0])[0]) == 1
    with pytest.raises(ParameterError, match="start = "):
        POSE.check("start", [-3.001, 0, 0])
    with pytest.raises(ParameterError, match="start = "):
        POSE.check("start", [0, 0, math.inf])


def test_the_task_of_centres_is_that_of_the_layout_that_has_them():
    np.testing.assert_array_equal(
        paper.task(paper.LAYOUTS["B"]).discs, paper.task_among(paper.centres_of("B")).discs
    )
    moved = paper.task("B", start=(0, 0, 0), target=(1, 2, 3))
    np.testing.assert_array_equal((moved.start, moved.target), ((0, 0, 0), (1, 2, 3)))
