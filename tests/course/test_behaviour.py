"""Functions that readers write are judged by what they do."""

import numpy as np
import pytest

from nmpcrl.course import Outcome, Unsolved, function
from nmpcrl.course.cases import telling

FORGOTTEN = "The square is forgotten."


def squares(x):
    return (x**2).sum()


def check(answer) -> Outcome:
    def draw(rng):
        return {"x": rng.normal(size=3)}

    return function(answer, squares, draw, mistakes={FORGOTTEN: lambda x: x.sum()})


def test_a_function_that_does_the_same_is_right():
    assert check(lambda x: x @ x).said == "Right: it does what it should in 20 random cases."


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda x: x.sum(), FORGOTTEN),
        (lambda x: x @ x + 1, r"It is wrong in 20 of 20 .* for x = \[.*\] it gives .* is right"),
        (lambda x: x, "is right"),
        (lambda x: "nothing", "'nothing'"),
        (lambda x: None, "gives None"),
        (lambda x, y: x, r"It fails for x = \[.*\] with TypeError"),
        (lambda x: 1 / 0, "with ZeroDivisionError: division by zero"),
        (3, "A function is asked for"),
    ],
)
def test_a_wrong_function_is_met_with_a_sentence_that_helps(answer, said):
    with pytest.raises(Unsolved, match=said) as raised:
        check(answer)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("answer", [..., lambda x: ...])
def test_a_function_that_returns_dots_is_not_answered(answer):
    with pytest.raises(Unsolved, match="Not answered"):
        check(answer)


def test_tuples_are_compared_one_by_one():
    def draw(rng):
        return {"x": rng.normal()}

    def both(x):
        return x, np.array([x, 2 * x])

    assert function(both, both, draw).said.startswith("Right")
    with pytest.raises(Unsolved):
        function(lambda x: (x, np.array([x, x])), both, draw)
    with pytest.raises(Unsolved):
        function(lambda x: x, both, draw)


class Everything:
    """Equal to whatever it is compared with."""

    def __eq__(self, other: object) -> bool:
        return True


@pytest.mark.parametrize("right", ["a text", None, {"a": 1}, ("a text", 1.0)])
def test_an_object_that_is_equal_to_everything_is_not_right(right):
    alike = tuple(Everything() for _ in right) if isinstance(right, tuple) else Everything()
    with pytest.raises(Unsolved, match="wrong in 20 of 20"):
        function(lambda x: alike, lambda x: right, lambda rng: {"x": rng.normal()})


def test_a_mistake_that_seldom_shows_or_differs_from_another_has_its_sentence_and_a_case():
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
    mistakes = {"Over half.": lambda x: x > 0.5, "A little more.": lambda x: x > 0.51}
    for why, wrong in [*mistakes.items()] * 20:
        with pytest.raises(Unsolved, match=why):
            function(wrong, lambda x: x > 0.9, lambda rng: {"x": rng.uniform()}, mistakes=mistakes)
    rng = np.random.default_rng(0)
    cases = telling(lambda: rng.uniform(), 2, [lambda x: x > 0.95, lambda x: x < 0.05])
    assert len(cases) == 4
    assert cases[2] > 0.95
    assert cases[3] < 0.05
