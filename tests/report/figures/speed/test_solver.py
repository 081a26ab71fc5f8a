"""Figures of the appendix on the solver, drawn from small inputs and read back."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.report.figures.speed import solver as draw


def iterates(*errors: float) -> pd.DataFrame:
    """A trace with these errors."""
    errors_ = np.array(errors)
    columns = {"error": errors_, "mu": errors_ / 10, "value": 700 + errors_, "delta": 0 * errors_}
    return pd.DataFrame(columns)


def timings(solvers: tuple[str, ...] = ("fatrop", "riccati")) -> pd.DataFrame:
    rows = [
        {
            "solver": solver,
            "horizon": horizon,
            "ms": (state + 1) * horizon**1.5,
            "us_per_iteration": (state + 1) * horizon**1.0,
        }
        for solver in solvers
        for horizon in (5, 10, 20)
        for state in (0, 1)
    ]
    return pd.DataFrame(rows)


def test_the_rows_are_drawn_with_their_limit(assert_readable):
    h = np.linspace(-1, 1, 5)
    curves = {mu: np.maximum(0, 100 * h) + mu for mu in (10.0, 1.0, 0.1)}
    figure = draw.row_prices(h, curves, {mu: np.linspace(0, 1, 5) for mu in curves})
    assert_readable(figure)
    left, right = figure.axes
    assert left.lines[-1].get_ydata() == pytest.approx(100 * np.maximum(0, h), rel=2e-3)
    assert list(right.lines[-1].get_ydata()) == [0, 0, 0.5, 1, 1]


def test_the_sparsity_title_says_how_narrow_the_band_is(assert_readable, texts):
    far = np.eye(9) + np.eye(9, k=7) + np.eye(9, k=-7)
    narrow = np.eye(9) + np.eye(9, k=2) + np.eye(9, k=-2)
    figure = draw.sparsity(far, narrow, np.eye(5), step=2)
    assert_readable(figure)
    assert "farther than 2 from" in texts(figure)
    assert [axes.get_xlabel()[:11] for axes in figure.axes] == [f"bandwidth {k}" for k in (7, 2, 0)]
    (square,) = figure.axes[2].patches
    assert (square.get_xy(), square.get_width()) == ((2.5, 2.5), 2)


def test_the_bandwidth_of_nothing_is_zero():
    assert draw.bandwidth(np.zeros((3, 3))) == 0


@pytest.mark.parametrize(
    ("last", "says"), [(1e-9, "without it 3"), (1e-3, "without it more than 3")]
)
def test_the_curvature_title_counts_iterations_and_says_whether_they_were_enough(
    last, says, assert_readable, texts
):
    figure = draw.curvature(iterates(10, 1, 1e-9), iterates(10, 1, 0.1, last), tolerance=1e-8)
    assert_readable(figure)
    assert texts(figure).strip() == f"With the curvature 2 iterations, {says}"


def test_the_starts_are_distinct_and_counted(assert_readable, texts):
    traces = {
        "cold": iterates(10, 1, 0.1, 1e-9),
        "shifted": iterates(1, 0.1, 1e-9),
        "same state": iterates(0.1, 1e-9),
    }
    figure = draw.convergence(traces, tolerance=1e-8)
    assert_readable(figure)
    assert "cold 3, shifted 2, same state 1" in texts(figure)
    lines = figure.axes[0].lines[::2][:3]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 3


def test_an_iterate_of_the_final_value_does_not_break_the_logarithm(assert_readable):
    early = iterates(10, 1, 1e-9).assign(value=[800.0, 700.0, 700.0])
    figure = draw.convergence({"cold": early}, tolerance=1e-8)
    assert_readable(figure)
    assert (figure.axes[1].lines[0].get_ydata() > 0).all()


def test_the_title_states_how_the_first_solver_scales(assert_readable, texts):
    figure = draw.horizons(timings())
    assert_readable(figure)
    assert "With riccati a solve grows like $N^{1.50}$, an iteration like $N^{1.00}$" in texts(
        figure
    )
    assert "fatrop" in texts(draw.horizons(timings(("fatrop",))))
