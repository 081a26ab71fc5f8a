"""Random cases: a wrong answer that shows seldom is not right by chance."""

import numpy as np
import pytest

from nmpcrl.course import Unsolved
from nmpcrl.course.behaviour import function
from nmpcrl.course.cases import telling


def test_a_known_mistake_that_shows_in_one_case_of_a_hundred_is_always_met():
    def above(x: float) -> bool:
        return x > 0.99

    for _ in range(20):
        with pytest.raises(Unsolved, match="Some are above"):
            function(
                lambda x: False,
                above,
                lambda rng: {"x": float(rng.uniform())},
                mistakes={"Some are above.": lambda x: False},
            )


def test_of_two_mistakes_that_seldom_differ_each_has_its_sentence():
    mistakes = {"Over half.": lambda x: x > 0.5, "A little more.": lambda x: x > 0.51}
    for why, wrong in [*mistakes.items()] * 20:
        with pytest.raises(Unsolved, match=why):
            function(wrong, lambda x: x > 0.9, lambda rng: {"x": rng.uniform()}, mistakes=mistakes)


def test_one_more_is_kept_for_each_mistake_that_they_do_not_tell():
    rng = np.random.default_rng(0)
    cases = telling(lambda: rng.uniform(), 2, [lambda x: x > 0.95, lambda x: x < 0.05])
    assert len(cases) == 4
    assert cases[2] > 0.95
    assert cases[3] < 0.05
