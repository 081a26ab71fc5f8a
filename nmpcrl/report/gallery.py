"""Six examples for the laboratory, four of them picked from the published runs.

They illustrate, and are evidence for no claim. The criteria were written down first, and two were
changed after a first look: runs that overshoot come from all published runs, because the main
table has only one such run that a page can repeat, in 0.02 % of its steps; and of a pair of DES and
RDES a theta that had moved must have been judged, instead of both runs having finished.

A page repeats the numbers of a run but for its last digits, unless a network learns; then it trains
the same experiment, and rounds otherwise.

- *a gap that closes*: of the runs that a page can repeat and whose cost rose because a gap closed
  (`claims.failure_modes`), the one whose final cost is the highest multiple of its first;
- *a run that overshoots*: of the runs that a page can repeat, the one with the largest share of
  steps with alpha ||phi||^2 above `OVERSHOOT`;
- *DES fails, RDES does not*, and *the reverse*: of the layouts and readings of the decay in the
  main table, the one in which the shares of runs that went wrong differ most in this direction, and
  in it the first seed of which one run went wrong and the other did not; of the one that did, a
  theta that had moved must have been judged, or there is nothing to show.

The others are `examples.kink` and `examples.tie`.
"""

from collections.abc import Iterator
from math import ceil, isfinite
from typing import Any

from nmpcrl.analysis.rows import experiment_of
from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims.failure_modes import Mechanism
from nmpcrl.claims.published import Published
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.examples import SETTINGS, Example, example, first_rollout, kink, tie
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Stopped

REPEATED = ("ES", "GES", "TDC", "QL")  # by a page

Row = dict[str, Any]  # of `runs.csv`


def gallery(study: Published) -> tuple[Example, ...]:
    """The six examples, without those of which the study has no run."""
    repeated = [row for e, row in study.rows.items() if _is_repeated(e)]
    six = (
        closed_gap(repeated),
        overshoot(repeated),
        kink(),
        one_fails(study, "DES", "RDES"),
        one_fails(study, "RDES", "DES"),
        tie(),
    )
    return tuple(one for one in six if one)


def closed_gap(rows: list[Row]) -> Example | None:
    """theta_c grows until no plan fits through a gap that the first rollout goes through."""
    closed = [row for row in rows if row["mechanism"] == Mechanism.GAP]
    closed = [row for row in closed if isfinite(row["final_cost"])]
    if not closed:
        return None
    row = max(closed, key=lambda row: row["final_cost"] / row["initial_cost"])
    experiment = experiment_of(row)
    sentence = (
        "{learner} raises {{c}} to {theta_c:.2f}. The gap that the first rollout goes through"
        " closes at {closes_at:.2f}, and the noise-free cost rises from {first:.0f} to {last:.0f}."
    )
    numbers = {
        "closes_at": closes_at(experiment.task, first_rollout(experiment).states[:, :2]),
        "theta_c": row["theta_8"],
        "first": row["initial_cost"],
        "last": row["final_cost"],
    }
    look = (
        "Look at {c} and at the cost without noise: where the one passes the closing of the"
        " gap, the other jumps. On the map, the dashed circles then overlap."
    )
    return example("A gap that closes", sentence, numbers, experiment, look=look)


def overshoot(rows: list[Row]) -> Example | None:
    """Steps so long that the TD error grows."""
    row = max(rows, key=lambda row: row["over"], default={"over": 0})
    if not row["over"]:
        return None
    sentence = (
        "With α = {alpha:.0e}, α‖φ‖² is above {limit:.0f} in {share:.1%} of the steps"
        " of {learner}: these steps overshoot, and the noise-free cost goes from {first:.0f} to"
        " {last:.0f}."
    )
    numbers = {
        "share": row["over"],
        "alpha": row["alpha"],
        "limit": OVERSHOOT,
        "first": row["initial_cost"],
        "last": row["final_cost"],
    }
    look = "Look at the largest α‖φ‖²: above the line at {limit:.0f} a step overshoots."
    return example(
        "A run that overshoots",
        sentence,
        numbers,
        experiment_of(row),
        look=look.format(limit=OVERSHOOT),
    )


def one_fails(study: Published, wrong: str, well: str) -> Example | None:
    """A layout in which one of two learners goes wrong more often than the other."""
    pair = next(_pairs(study, wrong, well), None)
    if pair is None:
        return None
    one, other, shares = pair
    experiment = experiment_of(one)
    end = "ends at a noise-free cost of {last:.0f}"
    if one["stopped"] != Stopped.FINISHED:
        end = "is stopped in episode {episode}"
    sentence = (
        f"In layout {experiment.layout}, with noise that decays per {experiment.decay},"
        f" {{wrong:.0%}} of the runs of {wrong} go wrong and {{well:.0%}} of those of {well}. With"
        f" seed {experiment.seed}, {wrong} {end}, and {well} ends at a cost of {{other:.0f}};"
        " at the start it is {first:.0f}. The network of this page rounds otherwise, so that a run"
        " may end with other numbers."
    )
    numbers = {
        **dict(zip(("wrong", "well"), shares, strict=True)),
        "first": one["initial_cost"],
        "last": one["final_cost"],
        "other": other["final_cost"],
        "episode": ceil(one["steps_done"] / experiment.steps),
    }
    look = (
        f"Look at the cost without noise while both train, {wrong} first, and then at the two"
        f" robots: {well}'s is the one with the dashed trajectory."
    )
    return example(
        f"{wrong} fails, {well} does not",
        sentence,
        numbers,
        experiment,
        look=look,
        against=experiment_of(other),
    )


def _pairs(
    study: Published, wrong: str, well: str
) -> Iterator[tuple[Row, Row, tuple[float, float]]]:
    """Runs of one seed, of which one went wrong, where this is most common; and both shares."""
    cells = {
        cell: tuple(here[here.learner == name] for name in (wrong, well))
        for cell, here in study.main.runs.groupby(["layout", "decay"])
    }
    shares = {cell: tuple((one.wrong != "").mean() for one in two) for cell, two in cells.items()}
    apart = {cell: bad - good for cell, (bad, good) in shares.items() if bad > good}
    if not apart:
        return
    cell = max(apart, key=lambda one: apart[one])
    bad, good = ({row["seed"]: row for row in one.to_dict("records")} for one in cells[cell])
    for seed in sorted(bad.keys() & good.keys()):
        one, other = bad[seed], good[seed]
        judged = study.summaries[experiment_of(one)].evaluations["episode"]
        if one["wrong"] and not other["wrong"] and len(judged) > 1:
            yield one, other, shares[cell]


def _is_repeated(experiment: Experiment) -> bool:
    """Whether a page can repeat a run: nothing but settings differs from the defaults."""
    settings = {name: getattr(experiment, name) for name in (*SETTINGS, "layout")}
    alike = experiment.canonical == Experiment(**settings).canonical
    return alike and experiment.learner in REPEATED
