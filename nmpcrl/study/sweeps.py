"""Many experiments at once: grids of field values, and the grid that a chapter shows."""

from collections.abc import Sequence
from dataclasses import fields
from itertools import product
from math import prod
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.geometry import Centres, are_centres
from nmpcrl.study.learners import DECAYS
from nmpcrl.study.parameters import Allowed, ParameterError, is_list, several, shown

VECTORS = ("theta", "start", "target")  # fields of which a list is one value
MOST_RUNS = 10_000  # of a sweep: more than five times the whole study
FIELDS: dict[str, Allowed] = {field.name: field.metadata["allowed"] for field in fields(Experiment)}
AXES: dict[str, Allowed] = {f"{name}s": several(one, name) for name, one in FIELDS.items()}


def sweep(**axes: Any) -> tuple[Experiment, ...]:
    """Every combination of field values; a list or tuple is an axis, anything else is fixed.

    `sweep(learner=("ES", "GES"), seed=[0, 1], episodes=20)` names four runs. A list of
    numbers is one `theta`, `start` or `target`; a list of pairs is one `layout`, by its centres.

    Raises:
        ParameterError: a value is not what it may be, an axis is empty, repeats itself or names
            no field, or there are too many runs.
    """
    choices = {name: _values(name, given) for name, given in axes.items()}
    count = prod(map(len, choices.values()))
    if count > MOST_RUNS:
        longest = max(choices, key=lambda name: len(choices[name]))
        raise ParameterError(
            f"{longest}s = {shown(axes[longest])} and the other axes make {count:,} runs;"
            f" {MOST_RUNS:,} are allowed"
        )
    return tuple(
        Experiment(**dict(zip(choices, combination, strict=True)))
        for combination in product(*choices.values())
    )


def _values(name: str, given: Any) -> tuple[Any, ...]:
    """The values of an axis, or the one value that is fixed."""
    if name not in FIELDS:
        raise ParameterError(f"{name!r} is not a parameter; there are {', '.join(FIELDS)}")
    text = isinstance(given, str) and given.strip().startswith("[")
    one = name in VECTORS or (name == "layout" and are_centres(given))
    if (text or is_list(given)) and not one:
        values: tuple[Any, ...] = AXES[f"{name}s"].check(f"{name}s", given)
        return values
    return (FIELDS[name].check(name, given),)


def paper_runs(
    episodes: int = paper.EPISODES,
    seeds: Sequence[int] = (0, 1),
    layout: str | Centres = "A",
    **others: Any,
) -> tuple[Experiment, ...]:
    """The runs that a chapter shows: the paper's learners, both readings of the decay, some seeds.

    Args:
        episodes: length of a run.
        seeds: one run of each learner and reading for each.
        layout: of the obstacles.
        others: further fields of `Experiment`, as `sweep` takes them.
    """
    grid = {"learner": (*PAPER, "frozen"), "decay": tuple(DECAYS), "seed": seeds}
    return sweep(**grid, episodes=episodes, layout=layout, **others)
