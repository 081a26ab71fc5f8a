"""A figure has at most two panels beside each other, is read in words, and can be seen."""

import ast
from io import BytesIO
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from legibility import CONTRAST, contrast, flaws

from nmpcrl.report.figures import sheet, style
from nmpcrl.report.figures.axes import below, draw_task
from nmpcrl.report.figures.runs import perturbed
from nmpcrl.study import Experiment, paper

START = 1e-12
TESTS = Path(__file__).resolve().parent
FIGURES = TESTS.parents[2] / "nmpcrl/report/figures"


@sheet.page
def bars(count: int = 3) -> sheet.Figure:
    """Some panels beside each other that share an axis."""
    figure, panels = sheet.subplots(1, count, sharey=True, squeeze=False)
    for panel in panels.flat:
        panel.plot([0, 1], [0, 1], color="black")
    panels[0, 0].set_ylabel("height [m]")
    return style.headed(figure, r"$\theta_x$ grows")


def places(figure: sheet.Figure) -> list[tuple[int, int]]:
    """Row and column of each panel."""
    specs = [axes.get_subplotspec() for axes in figure.axes]
    return [(spec.rowspan.start, spec.colspan.start) for spec in specs]


def shown(figure: sheet.Figure, monkeypatch) -> dict:
    """What a notebook is given to display."""
    bundles = []
    monkeypatch.setattr(sheet, "display", lambda data, raw: bundles.append(data))
    figure._ipython_display_()
    return bundles[0]


# Panels


def test_every_figure_function_is_drawn_by_a_test_of_this_folder():
    """And so it is looked at: see `legible`."""
    tests = "".join(path.read_text() for path in TESTS.rglob("test_*.py"))
    missing = [
        f"{path.stem}.{node.name}"
        for path in FIGURES.rglob("*.py")
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
        if any(isinstance(one, ast.Name) and one.id == "page" for one in node.decorator_list)
        if f"{node.name}(" not in tests and f".{node.name}" not in tests
    ]
    assert not missing


def test_at_most_two_panels_stand_beside_each_other():
    assert places(bars(2)) == [(0, 0), (0, 1)]
    assert places(bars(3)) == [(0, 0), (1, 0), (2, 0)]
    assert places(bars(4)) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert bars(4).get_size_inches()[0] == sheet.WIDTH


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, [(0, 0), (2, 0), (4, 0), (1, 0), (3, 0), (5, 0)]),
        ({"rowwise": True}, [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 0)]),
        ({"across": 2}, [(0, 0), (0, 1), (2, 0), (1, 0), (1, 1), (3, 0)]),
        ({"across": 3}, [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]),
    ],
)
def test_columns_stay_together_or_rows_do(options, expected):
    assert places(sheet.page(lambda: sheet.subplots(2, 3, **options)[0])()) == expected


def test_what_a_panel_said_for_those_beside_it_each_says_for_itself_below():
    assert [axes.get_ylabel() for axes in bars(2).axes] == ["height [m]", ""]
    for axes in bars(3).axes:
        assert axes.get_ylabel() == "height [m]"
        assert axes.yaxis.get_tick_params()["labelleft"]


def test_a_legend_has_as_many_columns_as_there_is_room_for():
    @sheet.page
    def draw(labels: list[str]) -> sheet.Figure:
        figure, axes = sheet.subplots()
        below(figure, [axes.plot([0, 1], color="black", label=label)[0] for label in labels])
        return style.headed(figure, "Four lines")

    short = draw(["one", "two", "three", "four"])
    long = draw(["a line that has a name", "another line", "a third one", "and one more of them"])
    assert short.legends[0]._ncols > long.legends[0]._ncols
    assert not flaws(short)
    assert not flaws(long)


def test_a_title_is_broken_where_the_sheet_ends_and_never_inside_a_formula():
    finding = r"Of many rollouts in many layouts, most end with $\theta_c = d_o + 1$ or above it"
    figure = sheet.page(lambda: style.headed(sheet.subplots()[0], finding))()
    assert figure.finding == finding.replace("$", "").replace("\\", "")
    figure.draw_without_rendering()
    lines = figure._suptitle._get_wrapped_text().split("\n")
    assert len(lines) > 1
    assert all(line.count("$") % 2 == 0 for line in lines)


def test_perturbed_replicas_that_come_apart_are_named():
    together, apart = np.full(40, START / 2), np.geomspace(START, 1e-3, 40)
    found = {Experiment("ES"): together, Experiment("RDES"): apart}
    title = perturbed.replicas(found, together, START).get_suptitle()
    assert title == "A difference of 1e-12 grows in runs of RDES"
    found = {Experiment("ES", decay="episode"): together}
    assert "none end further apart" in perturbed.replicas(found, together, START).get_suptitle()


# In words, and in files


@pytest.mark.parametrize(
    ("title", "words"),
    [
        (r"$\theta_x$ moves most, by up to 0.89", "theta_x moves most, by up to 0.89"),
        (r"$\theta_{\varphi_f}$ and $\theta_\varphi$", "theta_phi_f and theta_phi"),
        (r"near $\theta_c = d_o$", "near theta_c = d_o"),
        (r"$\theta_\mathrm{init}$", "theta_init"),
        (r"like $N^{1.02}$", "like N^1.02"),
        (r"largest $\alpha\,\|\phi\|^2$", "largest alpha ||phi||^2"),
        (r"$\beta$ = $2.5 \cdot 10^{-7}$", "beta = 2.5 times 10^-7"),
        ("6 of 6 verdicts\nstay", "6 of 6 verdicts stay"),
    ],
)
def test_a_title_is_read_in_words(title, words):
    assert sheet.in_words(title) == words


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_figure_gives_the_same_bytes(kind):
    assert bars().written(kind) == bars().written(kind)


def test_a_title_above_a_map_with_equal_scales_is_within_the_figure():
    figure, axes = sheet.subplots(height=3.7)
    draw_task(axes, paper.task("A"))
    axes.plot([-2.5, 8.5], [1.5, 2], label="a line")
    axes.set_title("It goes on", loc="left")
    below(figure, *axes.get_legend_handles_labels())
    image = plt.imread(BytesIO(figure.written("png")))
    assert (image[:3] == 1).all()


def test_a_notebook_is_shown_one_picture_and_its_finding(monkeypatch):
    bundle = shown(bars(), monkeypatch)
    assert set(bundle) == {"text/plain", "image/svg+xml"}
    assert bundle["text/plain"] == "theta_x grows"
    assert bundle["image/svg+xml"].encode() == bars().written("svg")


# What can be seen


@pytest.mark.parametrize("name", style.LOOKS)
def test_a_learner_s_line_can_be_seen_on_white(name):
    assert contrast(style.LOOKS[name].color) >= CONTRAST


def test_learners_are_told_apart_without_colour():
    for part in ("linestyle", "marker"):
        assert len({str(getattr(look, part)) for look in style.LOOKS.values()}) == len(style.LOOKS)
