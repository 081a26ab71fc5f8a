"""Motions against their closed forms, and what each predictor knows."""

import numpy as np
import pytest

from nmpcrl.study.motions import (
    KINDS,
    PERIOD,
    PREDICTORS,
    Polynomial,
    Sinusoidal,
    Straight,
    centres,
    draw,
    extrapolated,
    frozen,
    known,
    still,
)
from nmpcrl.study.parameters import ParameterError

SECONDS = np.linspace(-1, 30, 400)


def test_a_straight_motion_is_a_line():
    found = Straight((1.0, 2.0), (0.3, -0.1))(SECONDS)
    np.testing.assert_allclose(found, np.c_[1 + 0.3 * SECONDS, 2 - 0.1 * SECONDS])


def test_a_sinusoidal_motion_solves_the_equation_of_an_oscillator():
    motion, h = Sinusoidal((1.0, 2.0), (0.5, -0.25), period=8.0, phase=0.3), 1e-3
    before, now, after = (motion(SECONDS + k * h) for k in (-1, 0, 1))
    pull = -((2 * np.pi / 8) ** 2) * (now - [1.0, 2.0])
    np.testing.assert_allclose((after - 2 * now + before) / h**2, pull, atol=1e-6)


def test_a_polynomial_motion_stays_on_its_graph_at_its_speed_and_turns_at_both_ends():
    motion = Polynomial((1.0, 2.0), (0.0, 2.0), (0.1, 0.0, -0.4), speed=0.5, phase=0.2)
    x, y = (motion(SECONDS) - [1.0, 2.0]).T
    s = y / 2  # its axis points along y, and across it is -x
    np.testing.assert_allclose(x, -2 * (0.1 - 0.4 * s**2))
    assert (s.min(), s.max()) == pytest.approx((-1, 1), abs=0.02)
    steps = np.abs(np.diff(y)) / np.diff(SECONDS)
    assert np.median(steps) == pytest.approx(0.5)
    assert steps.max() <= 0.5 + 1e-9
    assert motion(np.zeros(1))[0, 1] == pytest.approx(2 + 2 * 0.2)


def test_extrapolation_is_exact_where_the_velocity_is_constant_and_nowhere_else():
    straight = [Straight((1.0, 2.0), (0.3, -0.1)), Straight((4.0, 0.0))]
    np.testing.assert_allclose(extrapolated(straight, 7), known(straight, 7), atol=1e-12)
    swinging = [Sinusoidal((1.0, 2.0), (0.5, 0.0), period=8.0)]
    assert np.abs(extrapolated(swinging, 7) - known(swinging, 7)).max() > 0.05


@pytest.mark.parametrize("name", PREDICTORS)
def test_what_stands_still_is_foretold_by_everyone_to_the_last_bit(name):
    layout = ((0.5, 2.2), (3.0, 0.5))
    found = PREDICTORS[name](still(layout), 5, 3)
    np.testing.assert_array_equal(found, np.broadcast_to(layout, (4, 2, 2)))


def test_every_predictor_knows_where_the_obstacles_are_now():
    motions = [Sinusoidal((1.0, 2.0), (0.5, 0.0), period=8.0)]
    for predict in PREDICTORS.values():
        np.testing.assert_array_equal(predict(motions, 9, 4)[0], centres(motions, [9])[0])
    assert (frozen(motions, 9, 4) == centres(motions, [9])).all()
    np.testing.assert_array_equal(
        centres(motions, [9])[0, 0], motions[0](np.array([9 * PERIOD]))[0]
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_draws_the_same_motion_and_its_mean_speed_is_what_was_drawn(kind):
    def drawn(seed, speed=0.3):
        return draw(np.random.default_rng(seed), kind, (2.0, 1.0), speed=speed, spread=0.0)

    assert drawn(4) == drawn(4)
    assert drawn(4) != drawn(5)
    assert isinstance(drawn(4), KINDS[kind])
    times = np.arange(0, 20, 1e-2)
    lengths = np.linalg.norm(np.diff(drawn(4)(times), axis=0), axis=1)
    least, most = (0.295, 0.305) if kind != "polynomial" else (0.295, 0.3 * np.hypot(1, 1.5 + 1.5))
    assert least <= lengths.sum() / 20 <= most


def test_another_kind_is_refused():
    with pytest.raises(ParameterError, match="one of straight, sinusoidal, polynomial"):
        draw(np.random.default_rng(0), "brownian", (0.0, 0.0), speed=0.3, spread=0.1)
