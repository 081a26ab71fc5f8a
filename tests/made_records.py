"""Records with drawn numbers, which take no training, and the comparison of two runs."""

from dataclasses import asdict

import numpy as np

from nmpcrl.study import Experiment, Records
from nmpcrl.study.records import COLUMNS
from nmpcrl.study.run import COUNTED

CLOCKS = {"seconds"}


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


def assert_same_numbers(one, other, but: frozenset[str] = frozenset()) -> None:
    """Two Records, or two summaries, have the same numbers, times and `but` apart."""
    assert one.facts["final_cost"] == other.facts["final_cost"]
    for name in vars(one).keys() - {"experiment", "facts"}:
        table, beside = getattr(one, name), getattr(other, name)
        if not isinstance(table, dict):
            table, beside = {name: table}, {name: beside}
        for column in table.keys() - CLOCKS - but:
            np.testing.assert_array_equal(table[column], beside[column])
