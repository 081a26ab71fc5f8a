"""Layouts and robustness analysis: titles follow from the runs, and nothing is left undrawn."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from builders import summary_of
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from nmpcrl.analysis.rows import table
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.robustness import robustness_map
from nmpcrl.report.figures.verdicts import layouts as figures
from nmpcrl.report.figures.verdicts import robustness as maps
from nmpcrl.study import design, paper
from nmpcrl.study.experiment import MAIN as LEARNERS
from nmpcrl.study.store import Runs

VARIANT = "Q(s, a)"
SEEDS = (0, 1, 2, 3, 4)
# Between the last two obstacles of layout A, whose gap closes at theta_c = 0.36.
WAY = np.array([[-2.5, 1.5, 0.0], [5.5, 0.5, 0.0], [7.5, 2.5, 0.0], [8.5, 2.0, 0.0]])


def study(episodes: int = paper.EPISODES, gained: float = 0.1) -> Evidence:
    """Two layouts, in which learners save a tenth, and a variant in which they save `gained`."""
    parts = dict.fromkeys(
        design.main_table(LEARNERS, ("A", "D"), SEEDS, episodes), design.MAIN_TABLE
    )
    varied = (replace(e, episodes=episodes) for e in design.variant(VARIANT))
    parts |= {e: VARIANT for e in varied if e not in parts}
    summaries = {}
    for experiment, part in parts.items():
        gain = gained if part == VARIANT else 0.1
        summaries[experiment] = summary_of(experiment, end=1 - gain, states=WAY)
    runs = table(summaries).assign(variant=list(parts.values()), source="published")
    return Evidence(Runs(summaries), runs)


@pytest.fixture(scope="module")
def changing() -> tuple[Evidence, pd.DataFrame]:
    """A study in which C9 changes in the row of the variant, and its map."""
    found = study(gained=-0.2)
    return found, robustness_map(found.runs, found.paths)


def title(figure: Figure) -> str:
    return figure.get_suptitle()


def frames(figure: Figure) -> list[Rectangle]:
    (axes,) = figure.axes
    black = to_rgba("black")
    return [p for p in axes.patches if p.get_edgecolor() == black and not p.get_fill()]


def written(figure: Figure) -> list[str]:
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    return [text for text in texts if text]


def test_a_layout_is_called_by_the_narrowest_gap_of_its_rollout():
    figure = figures.layouts({"A": WAY, "D": WAY})
    names = [axes.get_title("left") for axes in figure.axes if axes.get_visible()]
    assert names[0] == "A: open, +0.01 m"
    closing = sum("closing" in name for name in names)
    assert f"In {closing} of 2 layouts" in title(figure)


def test_only_narrow_gaps_are_drawn_from_centre_to_centre():
    figure = figures.layouts({"A": WAY})
    x, y, _ = paper.task("A").discs
    gap = [line for line in figure.axes[0].get_lines() if line.get_color() == figures.OPEN]
    ends = {tuple(np.round(line.get_xydata().ravel(), 6)) for line in gap}
    assert (x[2], y[2], x[3], y[3]) in ends
    assert all(abs(line.get_ydata()[1]) < 3 for line in gap)  # no wall is near


def test_the_map_has_a_frame_and_an_arrow_for_every_change(changing):
    found, rows = changing
    figure = maps.verdict_map(rows, "Some change", found.mark)
    changes = int(rows.changes.sum())
    assert changes > 0
    assert len(frames(figure)) == changes
    arrows = [text for text in written(figure) if "→" in text]
    assert len(arrows) == changes
    assert "yes→no" in arrows


def values(found: Evidence) -> dict[str, pd.DataFrame]:
    return {claim: one.measure(found.runs, found.paths) for claim, one in BY_RUNS.items()}


@pytest.mark.slow
def test_the_borders_are_drawn_where_they_were_fixed():
    figure = figures.borders(values(study().main), "")
    for axes, claim in zip(figure.axes, BY_RUNS.values(), strict=True):
        assert any(list(line.get_xdata()) == [claim.threshold] * 2 for line in axes.get_lines())
    assert "verdicts stay" in title(figure)


def test_a_claim_keeps_its_verdict_between_the_borders_named():
    outcome = ["no", "no", "yes", "yes", "yes", "no", "yes"]
    curve = pd.DataFrame({"border": np.arange(1.0, 8.0), "outcome": outcome})
    assert figures.same_verdict(curve, 4.0) == (3.0, 5.0)
    assert figures.same_verdict(curve, 1.0) == (1.0, 2.0)
    assert figures.same_verdict(curve, 7.0) == (7.0, 7.0)
