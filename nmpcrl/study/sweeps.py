"""Many experiments at once: grids of field values, and the grid that a chapter shows."""

from collections.abc import Sequence
from dataclasses import fields
from itertools import product
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.parameters import ParameterError
from nmpcrl.study.setup import DECAYS


def sweep(**axes: Any) -> tuple[Experiment, ...]:
    """Every combination of field values; a list or tuple is an axis, anything else is fixed.

    `sweep(learner=("ES", "GES"), seed=[0, 1], episodes=20)` names four runs. `theta` is one value.

    Raises:
        ParameterError: a value is not what it may be, or an axis is empty or names none.
    """
    known = {field.name for field in fields(Experiment)}
    for name, value in axes.items():
        if name not in known:
            raise ParameterError(f"{name!r} is not a parameter; there are {', '.join(known)}")
        if isinstance(value, str) and value.strip().startswith("["):
            raise ParameterError(
                f"{name}s = {value!r} arrived as text, not as a list;"
                f" write -y '{{{name}s: {value}}}'"
            )
        if isinstance(value, list | tuple) and not value:
            raise ParameterError(f"{name}s = {value!r} must name at least one {name}")
    choices = {
        name: value if isinstance(value, list | tuple) and name != "theta" else [value]
        for name, value in axes.items()
    }
    return tuple(
        Experiment(**dict(zip(choices, combination, strict=True)))
        for combination in product(*choices.values())
    )


def paper_runs(
    episodes: int = paper.EPISODES,
    seeds: Sequence[int] = (0, 1),
    layout: str = "A",
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
