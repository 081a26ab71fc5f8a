"""Checks of exercises: wrong answers that look right, and right ones that look different."""

import numpy as np
import pytest

from nmpcrl.course import Unsolved, number
from nmpcrl.course.checks import beyond, expected_sarsa, ges, mdp_and_nmpc, performance, solver


def forgets(cost, start, rounds, seed):
    best, rng = start, np.random.default_rng(seed)
    for _ in range(rounds):
        best = min(best + 0.3 * rng.normal(size=(8, best.size)), key=cost)
    return best


def largest(overlaps):
    return 50 * np.maximum(0, overlaps + 0.35).max()


def unsigned(overlaps):
    return 50 * np.abs(overlaps + 0.35).sum()


def saved_in_forty(training, frozen):
    return 1 - training[-40:].mean() / frozen[-20:].mean()


def saved_beside_all(training, frozen):
    return 1 - training[-20:].mean() / frozen.mean()


RIGHT = [
    (mdp_and_nmpc.distance, "1.375 m"),
    (mdp_and_nmpc.distance, "1,375"),
    (mdp_and_nmpc.reach, "0.12·N"),
    (mdp_and_nmpc.reach, "0.6 × 0.2 × N"),
    (performance.speed_up, lambda old, new: old.sum() / new.sum()),
]


@pytest.mark.parametrize(("check", "answer"), RIGHT)
def test_a_right_answer_that_looks_different_is_right(check, answer):
    for _ in range(5):
        assert check.__wrapped__(answer).right


WRONG = [
    (mdp_and_nmpc.distance, 1.25, "there the overlap is 0|where the overlap is 0"),
    (mdp_and_nmpc.distance, "1.375 km", "is no number"),
    (mdp_and_nmpc.reach, "0.12N", r"a product needs its \*"),
    (mdp_and_nmpc.penalty, lambda overlaps: 50 * max(0, overlaps.max() + 0.35), "both are charged"),
    (
        mdp_and_nmpc.penalty,
        largest,
        "both are charged",
    ),
    (
        mdp_and_nmpc.penalty,
        unsigned,
        "wrong in .* it gives",
    ),
    (
        expected_sarsa.saved,
        saved_in_forty,
        "cases: it gives",
    ),
    (
        expected_sarsa.saved,
        saved_beside_all,
        "cases: it gives",
    ),
    (ges.parallel, 7.87, "take the inverse"),
    (solver.golden, 1.6, "after two steps"),
    (solver.residual, lambda gradient, jacobian, g, multipliers: 0.0, "It is 0 where"),
    (solver.residual, lambda gradient, jacobian, g, multipliers: 1.0, "gives 1 instead of 0"),
    (solver.residual, lambda gradient, jacobian, g, multipliers: ..., "Not answered"),
    (performance.speed_up, lambda old, new: (old / new).mean(), "Exchanged, it must give"),
    (performance.speed_up, lambda old, new: (new / old).mean(), "the answer is 3"),
    (performance.speed_up, lambda old, new: 3.0, "the answer is twice as large"),
    (beyond.search, forgets, "keep the best"),
    (beyond.search, lambda cost, start, rounds, seed: start, "draws the same steps"),
]


@pytest.mark.parametrize(("check", "answer", "said"), WRONG)
def test_a_wrong_answer_that_looks_right_is_met_with_a_sentence(check, answer, said):
    for _ in range(5):
        with pytest.raises(Unsolved, match=said) as raised:
            check.__wrapped__(answer)
        assert "for  it" not in str(raised.value)
        assert "True" not in str(raised.value)


@pytest.mark.parametrize("answer", ["2,7e-7", "2.7e-7", "2.7·10⁻⁷", "0.00000027"])
def test_a_number_may_be_typed_as_it_is_printed(answer):
    assert number(answer, 2.7e-7).right
