"""Records with drawn numbers, which take no training, and the comparison of two runs."""

from dataclasses import asdict

import numpy as np

from nmpcrl.study import Experiment, Records
from nmpcrl.study.records import EvaluationRow, StepRow, form_of

CLOCKS = {"seconds"}


def made_records(experiment: Experiment, rows: int, seed: int = 0) -> Records:
    """A run of the robot, always the same for a seed."""
    rng = np.random.default_rng(seed)

    def drawn(row: type, rows: int) -> dict[str, np.ndarray]:
        columns = form_of(row, 3, 2, 9, experiment.steps).fields.items()
        return {
            name: (10 * rng.normal(size=(rows, *kind.shape))).astype(kind.base)
            for name, (kind, _) in columns
        }

    steps = drawn(StepRow, rows) | {"alpha_phi2": rng.normal(size=rows)}
    facts = {"stopped": "diverged: “why”", "solver": "riccati", "seconds": 1.25}
    facts["final_cost"] = seed / 7 or np.inf
    return Records(asdict(experiment), steps, drawn(EvaluationRow, 3), facts)


def assert_same_numbers(one, other, but: frozenset[str] = frozenset()) -> None:
    """Two Records, or two summaries, have the same numbers, times and `but` apart."""
    assert one.facts["final_cost"] == other.facts["final_cost"]
    for name in vars(one).keys() - {"experiment", "facts"}:
        table, beside = getattr(one, name), getattr(other, name)
        if not isinstance(table, dict):
            table, beside = {name: table}, {name: beside}
        for column in table.keys() - CLOCKS - but:
            np.testing.assert_array_equal(table[column], beside[column])
