"""Figures of the appendix on the solver, drawn from small inputs and read back."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.report.figures import speed as draw


def iterates(*errors: float) -> pd.DataFrame:
    """A trace with these errors."""
    return pd.DataFrame({"error": errors})


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
    narrow = np.eye(5) + np.eye(5, k=2) + np.eye(5, k=-2)
    figure = draw.sparsity(far, narrow, step=2)
    assert_readable(figure)
    assert "farther than 2 from" in texts(figure)
    assert [axes.get_xlabel()[:11] for axes in figure.axes] == ["bandwidth 7", "bandwidth 2"]
    (square,) = figure.axes[1].patches
    assert (square.get_xy(), square.get_width()) == ((2.5, 2.5), 2)


def test_the_starts_are_distinct_and_counted(assert_readable, texts):
    traces = {
        "cold": iterates(10, 1, 0.1, 1e-9),
        "shifted": iterates(1, 0.1, 1e-9),
        "same state": iterates(0.1, 1e-9),
    }
    figure = draw.convergence(iterates(10, 1, 0.9), traces, tolerance=1e-8)
    assert_readable(figure)
    assert "cold 3, shifted 2, same state 1" in texts(figure)
    lines = figure.axes[1].lines[:3]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 3


def test_a_step_s_bar_is_the_sum_of_its_parts(timings, assert_readable, texts):
    figure = draw.learning_steps(timings)
    assert_readable(figure)
    assert "77% with riccati and 9% with ipopt" in texts(figure)
    panel = figure.axes[0]
    rest = panel.containers[-1]  # the last part of each bar
    ends = [bar.get_x() + bar.get_width() for bar in rest]
    assert ends == pytest.approx(timings.ms_per_step[:4])


def test_every_solver_and_the_paper_have_a_point(timings, assert_readable, texts):
    figure = draw.saving(timings, {"ipopt MX": 4.0, "rebuilt": 40.0})
    assert_readable(figure)
    assert "about 0.2 ms" in texts(figure)
    marks = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 1]
    at = [float(line.get_xdata()[0]) for line in marks if line.get_marker() != "None"]
    assert at == pytest.approx([0.04, 0.8, 2.0, 4.0, 40.0, 830.0], rel=0.01)
