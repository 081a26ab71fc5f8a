"""What tests are about and nobody trained: records, summaries, rows, evidence, times, failures."""

import json
import re
from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd

from nmpcrl.analysis.rows import EVAL_INSIDE, INSIDE, THETA, as_text
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.learners import PAPER_HOURS
from nmpcrl.claims.published import Evidence
from nmpcrl.study import Experiment, Records, design, paper
from nmpcrl.study.records import COLUMNS
from nmpcrl.study.run import COUNTED

START_COST = 1000.0  # noise-free cost of theta_init
AROUND = np.array([[-2.5, 1.5], [-2.5, 8.0], [3.0, 8.0], [8.5, 8.0], [8.5, 2.0]])  # no obstacle
TRAJECTORY = np.column_stack([AROUND, [0.0, 0.0, 0.0, 0.0, np.pi / 2]])
STILL = np.empty(0)  # the inputs of a robot that is not moved
CLOCKS = {"seconds"}
SOLVERS = {"riccati": 0.04, "fatrop": 0.8, "ipopt": 2.0}  # [ms] of a solve
SOLVES = {"ES": 2.0, "GES": 2.0, "RDES": 1.0, "DES": 1.0}  # of a step
FIT, REST = 0.2, 0.02  # [ms]

QUIET = {
    "stopped": "finished",
    "initial_cost": START_COST,
    "final_cost": START_COST,
    "late_cost_range": 0.0,
    "cost_ratio": 1.0,
    "steps_done": 39_000,
    "distance": 0.1,
    "imitation_with": 0.5,
    "imitation_without": 1.0,
}
NONE = ("inputs", "outside", "worst_overlap", "eval_worst_overlap", *INSIDE, *EVAL_INSIDE)


def raising(error: BaseException) -> Callable[..., NoReturn]:
    """A function that raises this, whatever it is given."""

    def fail(*_: object, **__: object) -> NoReturn:
        raise error

    return fail


def made_records(experiment: Experiment, rows: int, seed: int = 0) -> Records:
    """A run of the robot, always the same for a seed."""
    rng, steps = np.random.default_rng(seed), experiment.steps
    shapes = {"state": (3,), "action": (2,), "states": (steps, 3), "actions": (steps, 2)}
    shapes |= dict.fromkeys(("features", "theta", "w"), (9,))

    def drawn(table: str, rows: int) -> dict[str, np.ndarray]:
        columns = {
            name: 10 * rng.normal(size=(rows, *shapes.get(name, ()))) for name in COLUMNS[table]
        }
        return {name: one.astype(int) if name in COUNTED else one for name, one in columns.items()}

    facts = {"stopped": "diverged: “why”", "solver": "riccati", "seconds": 1.25}
    facts["final_cost"] = seed / 7 or np.inf
    return Records(asdict(experiment), drawn("steps", rows), drawn("evaluations", 3), facts)


def own_investigation() -> str:
    """The file of a reader's own investigation that Chapter 9 shows."""
    page = Path(__file__).parents[1] / "book" / "09_your_own.ipynb"
    texts = ("".join(cell["source"]) for cell in json.loads(page.read_text())["cells"])
    (block,) = (re.findall(r"```python\n(.*?)```", text, re.S) for text in texts if "CHAIN" in text)
    return str(block[0])


def assert_same_numbers(one, other, but: frozenset[str] = frozenset()) -> None:
    """Two Records, or two summaries, have the same numbers, times and `but` apart."""
    assert one.facts["final_cost"] == other.facts["final_cost"]
    for name in vars(one).keys() - {"experiment", "facts"}:
        table, beside = getattr(one, name), getattr(other, name)
        if not isinstance(table, dict):
            table, beside = {name: table}, {name: beside}
        for column in table.keys() - CLOCKS - but:
            np.testing.assert_array_equal(table[column], beside[column])


def quiet_row(experiment: Experiment, **unlike: Any) -> dict[str, Any]:
    """The row of a run in which nothing happened, with other values where `unlike` has them."""
    fields = {name: as_text(value) for name, value in asdict(experiment).items()}
    theta = dict(zip(THETA, experiment.theta, strict=True))
    return fields | QUIET | dict.fromkeys(NONE, 0) | theta | unlike


def timings(
    rdes=None, ges=None, width=0.0, waited=0.0, solvers=("fatrop", "ipopt")
) -> pd.DataFrame:
    """Times of learning steps, as of `time_learners`, in which only solves differ.

    Args:
        rdes: its ratio to ES, if it is not that of its parts.
        ges: likewise.
        width: of a ratio's interval, on either side.
        waited: share of the time.
        solvers: of `SOLVERS`.
    """
    rows = []
    for solver, (name, solves) in product(solvers, SOLVES.items()):
        solve, fit = SOLVERS[solver], FIT if name in ("RDES", "DES") else np.nan
        step = solves * solve + np.nan_to_num(fit) + REST
        ratio = {"RDES": rdes, "GES": ges}.get(name) or step / (2 * solve + REST)
        hours = {"hours": step * 39 / 3600, "hours_paper": PAPER_HOURS.get(name, np.nan)}
        parts = {"solver": solver, "learner": name, "solves": solves, "ms_per_step": step}
        parts |= {"ms_per_solve": solve, "ms_per_fit": fit, "ms_per_rest": REST, "waited": waited}
        ends = {"ratio": ratio, "ratio_low": ratio - width, "ratio_high": ratio + width}
        rows.append(parts | hours | ends)
    return pd.DataFrame(rows)


def evidence_of(
    unlike: Callable[[Experiment], dict[str, Any]] = lambda experiment: {},
    *,
    layouts: tuple[str, ...] = ("A", "D"),
    seeds: tuple[int, ...] = (0, 1, 2, 3),
    episodes: int = paper.EPISODES,
    source: Callable[[Experiment], str] = lambda experiment: "fresh",
) -> Evidence:
    """A main table in which every learner saves a tenth at once; `unlike` says what is not so."""
    wanted = design.main_table(layouts=layouts, seeds=seeds, episodes=episodes)
    summaries = {one: summary_of(one, **unlike(one)) for one in wanted}
    found = Evidence().joined(summaries, dict.fromkeys(wanted, design.MAIN_TABLE))
    return replace(found, runs=found.runs.assign(source=[*map(source, wanted)]))


def summary_of(
    experiment: Experiment,
    *,
    end: float = 0.9,
    swing: float = 0.0,
    training: float = 1.0,
    reached: int | None = None,
    states: np.ndarray = TRAJECTORY,
    actions: np.ndarray = STILL,
    inside: tuple[int, int, int] = (0, 0, 0),
    imitation: tuple[float, float] = (0.5, 1.0),
    **columns: Any,
) -> RunSummary:
    """A run in which little happens.

    Args:
        experiment: names it.
        end: its noise-free cost after the start, over the start's.
        swing: how much of the start's cost every other late rollout costs more.
        training: cost of its training episodes, over the start's.
        reached: after how many episodes it was stopped.
        states: of its last rollout without noise.
        actions: likewise; zeros by default.
        inside: states in an obstacle by size, in its first episode.
        imitation: held-out errors with and without theta.
        columns: further columns of `RunSummary.episodes`, or the value of all their rows.
    """
    count, every = experiment.episodes, experiment.evaluate_every
    due = np.unique([*range(0, count + 1, every), count])
    end = 1.0 if experiment.learner == "frozen" else end
    cost = START_COST * np.where(due == 0, 1.0, end)
    cost[(due >= count / 2) & (due // every % 2 == 0)] += swing * START_COST
    quiet = dict.fromkeys(("failed", "restarts", "outside", "inputs", "over"), 0)
    quiet |= {"steps": 130, "overlap": -0.1, "alpha_phi2": 0.4, "delta": 30.0, "loss": 1.0}
    quiet |= {"bias": 0.0, "error": 10.0, "iterations": 5.0, "seconds": 0.01}
    episodes = {name: np.full(count, value) for name, value in (quiet | columns).items()}
    episodes["cost"] = np.full(count, START_COST * training)
    episodes["theta"] = np.tile(experiment.theta, (count, 1))
    episodes["w"] = np.full((count, len(experiment.theta)), paper.W_INIT)
    episodes["inside"] = np.zeros((count, 3), int)
    episodes["inside"][0] = inside
    if reached is not None:
        due, cost = due[due <= reached], cost[due <= reached]
        episodes["cost"][reached:], episodes["theta"][reached:] = np.nan, np.nan
    evaluations = {
        "episode": due,
        "theta": np.tile(experiment.theta, (due.size, 1)),
        "cost": cost,
        "inside": np.zeros((due.size, 3), int),
        "overlap": np.full(due.size, -0.1),
        "distance": np.zeros(due.size),
    }
    errors = dict(zip(("with_theta", "without_theta"), imitation, strict=True))
    facts: dict[str, Any] = {"seconds": 1.0, "imitation": errors}
    facts["stopped"] = "finished" if reached is None else "diverged: theta"
    inputs = np.zeros((len(states), 2)) if actions is STILL else actions
    return RunSummary(asdict(experiment), episodes, evaluations, states, inputs, facts)


def scaled(one: RunSummary, factor: float, which: Any = slice(None)) -> RunSummary:
    """The same with other costs without noise."""
    cost = one.evaluations["cost"].copy()
    cost[which] *= factor
    return replace(one, evaluations=one.evaluations | {"cost": cost})
