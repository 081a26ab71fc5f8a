"""Figures of the benchmark: titles follow from the numbers, whichever way they fall."""

import matplotlib.pyplot as plt
import pytest

from nmpcrl.bench import summary
from nmpcrl.report.figures.speed import performance


def learning_steps(measured):
    return performance.learning_steps(summary.learners(measured))


def saving(measured):
    medians = summary.solvers(measured)["median"].groupby("solver").min() / 1e3
    return performance.saving(summary.learners(measured), medians[["ipopt MX", "rebuilt"]])


DRAWN = (
    performance.solve_times,
    learning_steps,
    performance.whole_runs,
    performance.scaling,
    saving,
)


def slower(measured, factor):
    """The benchmark on which every solve of a learner takes `factor` times as long."""
    table = measured["learners"]
    for i, solves in enumerate(table["solves"]):
        table["ms_per_step"][i] += (factor - 1) * solves * table["ms_per_solve"][i]
        table["ms_per_solve"][i] *= factor
    for i, step in enumerate(table["ms_per_step"]):  # the first of each solver is ES
        table["ratio"][i] = step / table["ms_per_step"][i - i % 4]
    return measured


@pytest.mark.parametrize("draw", DRAWN)
def test_every_figure_has_a_finding_and_axes_with_units(measured, draw):
    figure = draw(measured)
    assert figure.get_suptitle()
    named = [axis.get_xlabel() + axis.get_ylabel() for axis in figure.axes]
    assert any("[" in name or "ms" in name or "step of" in name for name in named)
    plt.close(figure)


def test_the_fastest_and_the_slowest_solver_are_named(measured):
    title = performance.solve_times(measured).get_suptitle()
    assert title == "riccati is fastest; rebuilt each time, a solve takes 1000 times as long"
    solves = measured["solves"]
    solves["seconds"] = [
        1e-6 if solver == "fatrop" else seconds
        for solver, seconds in zip(solves["solver"], solves["seconds"], strict=True)
    ]
    assert performance.solve_times(measured).get_suptitle().startswith("fatrop is fastest")


def test_the_network_s_share_is_given_for_the_fastest_and_the_slowest_solver(measured):
    title = learning_steps(measured).get_suptitle()
    assert title == "Of a step of RDES the network takes 77% with riccati and 9% with Ipopt, SX"


def test_a_step_s_bar_is_the_sum_of_its_parts(measured):
    panel = learning_steps(measured).axes[0]
    ends = [bar.get_x() + bar.get_width() for bar in panel.patches[-4:]]
    assert ends == pytest.approx(measured["learners"]["ms_per_step"][:4])


def test_what_one_more_costs_is_given(measured):
    title = performance.scaling(measured).get_suptitle()
    adds = "A stage adds 0.50 to 0.50 µs to an iteration, an obstacle 0.25 to 0.25 µs"
    assert title == adds


def test_runs_and_workers_are_given(measured):
    title = performance.whole_runs(measured).get_suptitle()
    assert title == "ES takes 4.0 s and RDES 16.0 s; 2 workers are 1.90 times as fast as one"


def test_workers_that_were_not_measured_are_not_given(measured):
    measured["parallel"] = {name: [] for name in measured["parallel"]}
    figure = performance.whole_runs(measured)
    assert figure.get_suptitle() == "ES takes 4.0 s and RDES 16.0 s"
    assert "not measured" in [text.get_text() for text in figure.axes[2].texts]


def test_with_a_fast_solver_the_network_costs_more_than_it_saves(measured):
    title = saving(measured).get_suptitle()
    assert (
        title
        == "With riccati, RDES takes 2.60 times as long as ES; the break-even is at about 0.2 ms"
    )


def test_with_slow_solvers_it_saves_time(measured):
    title = saving(slower(measured, 100)).get_suptitle()
    assert title.startswith("RDES saves time with every solver: with riccati, RDES takes 0.5")


def test_every_solver_and_the_paper_have_a_point(measured):
    axes = saving(measured).axes[0]
    names = {" ".join(text.get_text().split()) for text in axes.texts}
    assert {*performance.LABELS.values(), "the paper"} <= names
