"""What a value is made of: the same for what does the same, and different for what does not."""

import pickle
import sys
from dataclasses import dataclass
from functools import partial

import gymnasium
import numpy as np
import pytest

from nmpcrl.control.content import NoContent, content
from nmpcrl.learning import Descent, expected_sarsa
from nmpcrl.study import paper

GAIN = 2.0


def twice(x):
    """Read a number of the module."""
    return GAIN * x


def through(x):
    return twice(x) + 1


def closing(gain):
    return lambda x: gain * x


@dataclass(frozen=True)
class Rule:
    size: float

    def step(self, x):
        return self.size * through(x)


def functions(text):
    """The functions of a cell of a notebook."""
    names = {"__name__": "__main__"}
    exec(text, names)
    return names


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1.0, 1.0 + 1e-16 + 2e-16),
        (np.zeros(2), np.zeros(3)),
        (closing(1.0), closing(2.0)),
        (partial(expected_sarsa, alpha=1e-7), partial(expected_sarsa, alpha=1e-6)),
        (Descent(0.1), Descent(0.2)),
        (Rule(1.0), Rule(2.0)),
        (paper.nmpc("A"), paper.nmpc("B")),
        (*functions("f, g = (lambda x: x + 1), (lambda x: x + 2)").values(),)[-2:],
        tuple(functions(f"def f(x):\n    return {name}(x)")["f"] for name in ("abs", "len")),
        tuple(functions(f"class C:\n    def f(self):\n        return {k}")["C"] for k in (1, 2)),
    ],
)
def test_what_does_something_else_has_another_content(one, other):
    assert content(one) != content(other)
    assert content(one) == content(one)


def test_numbers_that_a_function_reads_are_part_of_it_and_names_and_comments_are_not(monkeypatch):
    found = [content(one) for one in (twice, through, Rule(1.0), Rule(1.0).step)]
    monkeypatch.setattr(sys.modules[__name__], "GAIN", 3.0)
    later = [content(one) for one in (twice, through, Rule(1.0), Rule(1.0).step)]
    assert all(one != other for one, other in zip(found, later, strict=True))
    one = functions("def f(x):\n    return x + 1")["f"]
    other = functions("# moved\n\ndef g(x):  # a comment\n    return x + 1")["g"]
    assert content(one) == content(other)
    text = "def f(n):\n    return n and f(n - 1)"
    assert content(functions(text)["f"]) == content(functions(text)["f"])
    one, other = (gymnasium.make("Pendulum-v1", g=g) for g in (9.81, 3.7))
    assert content(one) == content(gymnasium.make("Pendulum-v1", g=9.81)) != content(other)
    assert content(pickle.loads(pickle.dumps(one))) == content(one)


@pytest.mark.parametrize("value", [np.random.default_rng(0), closing(np.random.default_rng(0))])
def test_what_may_be_different_each_time_is_refused(value):
    with pytest.raises(NoContent, match=r"a Generator, .* has no content of which a name"):
        content(value)
