"""Every figure, drawn once: it can be read, is as wide as a page, and its colours are learners'."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

import numpy as np
import pandas as pd
import pytest
from builders import evidence_of
from legibility import contrast, flaws
from matplotlib.colors import to_hex

from nmpcrl.analysis.encounters import Contacts, Encounters
from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.analysis.imitation import imitate
from nmpcrl.analysis.trap import Stand
from nmpcrl.analysis.two_state import Chain
from nmpcrl.claims import published, thresholds
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.verdict import Assumption
from nmpcrl.learning.rollout import Rollout, evaluate
from nmpcrl.report import figures
from nmpcrl.report import worlds as report
from nmpcrl.report.drawn import at_the_gap
from nmpcrl.report.figures import (
    claims,
    comparisons,
    controller,
    layouts,
    learners,
    results,
    speed,
    style,
    trials,
)
from nmpcrl.report.figures.run import run_page
from nmpcrl.report.trace import trace
from nmpcrl.studies import population as drawn
from nmpcrl.studies import remedies as advice
from nmpcrl.studies import worlds as changing
from nmpcrl.study import Experiment, Runs, paper, run, sweep
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.moving import Straight

THETA, SMALL = np.array(paper.THETA_INIT), {"episodes": 4, "steps": 45, "evaluate_every": 2}
WAY = np.linspace(paper.START, paper.TARGET, paper.STEPS + 1)
FAILS = WAY[:15].repeat(3, axis=0)
GRID, ANGLE = np.linspace(0.0, 0.8, 5), np.linspace(-1, 1, 5)
KINDS = pd.Series([0.02, 0.03, 0.04])
SAVED = pd.DataFrame(
    {"oracle": KINDS - 0.035, "ES": KINDS, "ES+model": KINDS, "grid": KINDS + 0.03}
)
OPEN = Stand(0, 0.001, np.nan, WAY, 4000.0, True, 0.0, 0.1, 0.1, 0.0)
STUCK = replace(OPEN, arrived=False, stage_cost=30.0, value=900.0)
STANDS = [OPEN, *(replace(STUCK, episode=k, theta_c=k / 10) for k in (4, 8, 12))]


nmpc, whole, population_of = cache(paper.nmpc), cache(published.load), cache(drawn.load)


@cache
def runs(*learners: str) -> Runs:
    """Four short episodes of some learners, with both decays of the noise."""
    experiments = sweep(learner=learners, decay=("step", "episode"), **SMALL)
    return Runs({experiment: run(experiment) for experiment in experiments})


@cache
def made() -> Evidence:
    """A main table in which DES costs too much, and some runs are stopped."""
    return evidence_of(lambda e: {"training": 5.0, "reached": 150 if e.seed else None,
                                  "end": 1.2, "alpha_phi2": 3.0}
                       if e.learner == "DES" else {})  # fmt: skip


@cache
def loop() -> tuple[Rollout, list]:
    """A closed loop and the plans behind its first actions."""
    rollout = evaluate(nmpc(), THETA, 30)
    return rollout, [nmpc().solve(state, THETA) for state in rollout.states[:-10:3]]


@cache
def traced() -> pd.DataFrame:
    return trace(nmpc().ocp, paper.START, THETA)


def shifted(y: float) -> Rollout:
    return Rollout(WAY + [0, y, 0], np.zeros((len(WAY), 2)), np.ones(len(WAY)))


def verdict(name: str) -> object:
    return whole().verdict(name)


def outcome(stopped: bool) -> Outcome:
    numbers = np.linspace(0.1, 1.0, 8)
    return Outcome(stopped, 8, numbers, np.r_[0.0, numbers[1:-1], 1e6], numbers)


def predicted() -> object:
    known, parts = population_of(), population_of().runs.groupby("part")
    es = known.main[known.main.learner == "ES"].reset_index(drop=True)
    tuned, judged = drawn.succeeds(parts.get_group("tune")), drawn.succeeds(known.main)
    scores = drawn.predictor_scores(known.layouts, tuned, judged)
    return layouts.predictors(scores, es, at_the_gap(known).closes, "It tells")


LAYOUTS = dict.fromkeys("ABCDEF", 0.3)
MANY = pd.DataFrame({"episode": range(9), "ratio": 0.01})
RUN = Experiment(**SMALL)
FIGURES: dict[Callable, Callable] = {  # each drawing function, and how it is called
    controller.closed_loop: lambda draw: draw(paper.task("A"), *loop()),
    controller.receding_horizon: lambda draw: draw(paper.task("A"), *loop()),
    controller.action_values: lambda draw: draw(ANGLE[:2], ANGLE, np.ones((5, 2)), 0.9, ANGLE[:2]),
    controller.theta_effects: lambda draw: draw(
        paper.task("A"), shifted(0.0),
        {name: {"×¼": shifted(0.1), "×4": shifted(i / 9)} for i, name in enumerate(style.MEANINGS)},
    ),
    controller.penalty_gap: lambda draw: draw(paper.task("A"), GRID, np.r_[3, 1, 2, np.inf, 2]),
    controller.one_variable: lambda draw: draw(ANGLE, ANGLE**2, at=0.0, slope=-2.0),
    controller.shares_closed: lambda draw: draw(GRID, 2 * GRID, 0.4),
    controller.kink: lambda draw: draw(ANGLE, np.abs(ANGLE), 0.001, (-1.0, 1.0)),
    learners.theta_paths: lambda draw: draw(runs("ES")),
    learners.overshoot: lambda draw: draw(runs("ES", "GES"), ("ES", "GES")),
    learners.two_costs: lambda draw: draw(runs("ES", "frozen")),
    learners.literal_and_gated: lambda draw: draw(
        *(run(Experiment("RDES", gated=gated, **SMALL)) for gated in (False, True))
    ),
    learners.online: lambda draw: draw(runs("DES", "RDES")),
    learners.held_out_errors: lambda draw: draw(
        imitate(one, fits=5) for one in runs("ES").values()
    ),
    learners.interventions: lambda draw: draw(
        {name: {how: outcome(how == "none") for how in learners.WATCHED} for name in "AB"},
        "It ends",
    ),
    learners.on_the_chain: lambda draw: draw(Chain(), 0.1, (0.1, 1.0, 4.0), updates=50),
    results.learning_curves: lambda draw: draw(
        made(), ("DES", "RDES"), "A", thresholds.divergence, "diverged"
    ),
    results.controls: lambda draw: draw(made(), "A"),
    results.trajectories: lambda draw: draw(whole().main),
    results.reasons: lambda draw: draw(whole().main),
    results.by_layout: lambda draw: draw(
        whole().main, thresholds.cost_reduction(whole().main.runs), ("GES", "TDC"),
        label="gain", title="It gains", seen=(-0.1, 0.15),
    ),
    results.replicas: lambda draw: draw(
        {Experiment(name, decay=decay): 1e-12 * 1.1 ** np.arange(300)
         for name in ("ES", "RDES") for decay in ("step", "episode")}, np.full(40, 1e-9), 1e-12,
    ),
    claims.measured: lambda draw: draw(whole().main, verdict("C6")),
    claims.times: lambda draw: draw(whole().timings, verdict("C3"), "RDES"),
    claims.theorem: lambda draw: draw(
        [Assumption("one", "", holds=False)], verdict("C8"), run(Experiment("GES", **SMALL)), MANY
    ),
    claims.learners: lambda draw: draw(whole().main, "ES ends lowest"),
    layouts.layouts: lambda draw: draw(dict.fromkeys(paper.LAYOUTS, WAY)),
    layouts.shares: lambda draw: draw(*[population_of().shares] * 2, "It holds"),
    layouts.predictors: lambda draw: predicted(),
    layouts.trap: lambda draw: draw(paper.task("E"), STANDS, (0, 1, 3), "It stands"),
    layouts.cliffs: lambda draw: draw(
        GRID, dict.fromkeys(LAYOUTS, (4000 + GRID, 4100 + GRID)), LAYOUTS, "Up"
    ),
    comparisons.gains: lambda draw: draw(advice.advice(advice.REMEDIES.table()), "It gains"),
    comparisons.trajectories: lambda draw: draw(
        {name: dict.fromkeys(comparisons.WAYS, WAY) | {"init": FAILS} for name in paper.LAYOUTS}
    ),
    comparisons.models: lambda draw: draw(report.saved(changing.WORLDS.table())),
    comparisons.shifts: lambda draw: draw(dict.fromkeys(comparisons.ARMS, [np.ones(60)] * 4), 150),
    comparisons.views: lambda draw: draw(
        (Straight((3.0, 3.0), (0.0, -0.1)), Straight((5.0, 1.0), (0.1, 0.0))),
        {view: Encounters(WAY, 4000.0, Contacts(7, 1), True) for view in comparisons.SEEN},
    ),
    trials.costs: lambda draw: draw(
        pd.DataFrame([{"learner": name, "seed": 0, "episode": k, "cost": 9.0 - k}
                      for name in ("ES", "mine") for k in (0, 5)])
    ),
    trials.learned: lambda draw: draw(
        GRID, 1.0, {"before": ANGLE, "after": 0 * ANGLE}, ("mass [kg]", "height [m]")
    ),
    trials.known: lambda draw: draw({"ES": np.c_[GRID, ANGLE]}, np.ones(2)),
    speed.row_prices: lambda draw: draw(ANGLE, dict.fromkeys((10.0, 1.0, 0.1), ANGLE**2 + 1),
                                        dict.fromkeys((10.0, 1.0, 0.1), ANGLE**2)),
    speed.sparsity: lambda draw: draw(np.eye(9), np.eye(5), step=2),
    speed.convergence: lambda draw: draw(
        traced(), dict.fromkeys(("cold", "shifted", "same state"), traced()), 1e-8
    ),
    speed.saving: lambda draw: draw(whole().timings, {"ipopt MX": 4.0, "rebuilt": 40.0}),
    run_page: lambda draw: draw(run(RUN), run(frozen_arm(RUN))),
}  # fmt: skip


@pytest.mark.parametrize(
    "draw", FIGURES, ids=lambda draw: f"{draw.__module__.split('.')[-1]}.{draw.__name__}"
)
def test_a_figure_can_be_read_on_a_page(draw):
    figure = FIGURES[draw](draw)
    assert figure.get_size_inches()[0] == style.WIDTH
    assert figure.get_suptitle()
    assert figure.finding
    assert "$" not in figure.finding
    assert figure.written("svg").startswith(b"<?xml")
    assert flaws(figure) == []
    seen = [axes for axes in figure.axes if axes.get_visible() and axes.axison]
    for axes in seen:
        assert np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all()
    legends = [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]
    for handle in (one for legend in legends for one in legend.legend_handles):
        if handle.get_label() in style.LOOKS and hasattr(handle, "get_color"):
            assert to_hex(handle.get_color()) == to_hex(style.LOOKS[handle.get_label()].color)


@pytest.mark.slow
@pytest.mark.parametrize(
    "unlike",
    [
        {"episodes": 1},
        {"alpha": 1e-2},  # diverges
        {"learner": "frozen"},
        {"layout": ((0.5, 2.2), (3, 7)), "target": (6, 8, 0)},
    ],
    ids=str,
)
def test_any_run_has_a_page(unlike):
    one = replace(Experiment(episodes=3, steps=5, evaluate_every=1), **unlike)
    figure = run_page(run(one), None if one.learner == "frozen" else run(frozen_arm(one)))
    assert flaws(figure) == []
    assert figure.finding.startswith(f"{one.learner}: cost without noise ")


def test_every_figure_is_drawn_above():
    names = [f"{figures.__name__}.{one.name}" for one in iter_modules(figures.__path__)]
    drawing = {
        one
        for module in map(import_module, names)
        for one in vars(module).values()
        if hasattr(one, "__wrapped__") and one.__module__ == module.__name__
    }
    assert drawing == {*FIGURES}


def test_a_learner_is_told_from_others_without_colour_and_seen_on_white():
    for part in ("linestyle", "marker"):
        assert len({str(getattr(look, part)) for look in style.LOOKS.values()}) == len(style.LOOKS)
    assert min(contrast(look.color) for look in style.LOOKS.values()) >= 3


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_figure_gives_the_same_bytes(kind):
    one, other = (FIGURES[controller.kink](controller.kink) for _ in range(2))
    assert one.written(kind) == other.written(kind)


def test_a_notebook_is_shown_a_picture_that_need_not_be_trusted_and_its_finding(monkeypatch):
    shown = []
    monkeypatch.setattr(style, "display", lambda data, raw: shown.append(data))
    figure = style.titled(style.subplots()[0], r"$\theta_x$ grows")
    figure._ipython_display_()
    monkeypatch.setattr(style, "HEAVY", 0)
    figure._ipython_display_()
    assert {*shown[0]} == {"text/plain", "image/png", "image/svg+xml"}
    assert {*shown[1]} == {"text/plain", "image/png"}
    assert shown[0]["text/plain"] == "theta_x grows"
