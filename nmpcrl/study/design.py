"""Sets of runs: grids of field values, and the parts of the main study.

The main table varies layout, reading of the exploration decay, and seed, which the paper leaves
open. A variant changes one other field.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from itertools import product
from math import prod
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import MAIN, PAPER, Experiment, frozen_arm
from nmpcrl.study.learners import DECAYS, LEARNERS
from nmpcrl.study.parameters import Allowed, ParameterError, is_list, several

VECTORS = ("theta", "start", "target")  # fields of which a list is one value
MOST_RUNS = 10_000  # of a sweep: more than five times the whole study
FIELDS: dict[str, Allowed] = {one.name: one.metadata["allowed"] for one in fields(Experiment)}
AXES: dict[str, Allowed] = {f"{name}s": several(one, name) for name, one in FIELDS.items()}


def sweep(**axes: Any) -> tuple[Experiment, ...]:
    """Every combination of field values; a list or tuple is an axis, anything else is fixed.

    `sweep(learner=("ES", "GES"), seed=[0, 1], episodes=20)` names four runs. A list of
    numbers is one `theta`, `start` or `target`; a list of pairs is one `layout`, by its centres.
    ParameterError refuses values, names of fields, and too many runs.
    """
    choices = {name: _values(name, given) for name, given in axes.items()}
    count = prod(map(len, choices.values()))
    if count > MOST_RUNS:
        raise ParameterError(f"{', '.join(axes)} make {count:,} runs; {MOST_RUNS:,} are allowed")
    return tuple(
        Experiment(**dict(zip(choices, combination, strict=True)))
        for combination in product(*choices.values())
    )


def _values(name: str, given: Any) -> tuple[Any, ...]:
    """The values of an axis, or the one value of a fixed field."""
    if name not in FIELDS:
        raise ParameterError(f"{name!r} is not a parameter; there are {', '.join(FIELDS)}")
    axis = is_list(given) or (isinstance(given, str) and given.strip().startswith("["))
    if not axis or name in VECTORS:
        return (FIELDS[name].check(name, given),)
    if name == "layout":
        with suppress(ParameterError):  # the centres of one layout
            return (FIELDS[name].check(name, given),)
    values: tuple[Any, ...] = AXES[f"{name}s"].check(f"{name}s", given)
    return values


PERTURBATION = 1e-12  # added to theta_x at the start


def perturbed(experiment: Experiment) -> Experiment:
    """The replica of a run: theta_x of theta_init is moved by `PERTURBATION`."""
    first, *rest = experiment.theta
    return replace(experiment, theta=(first + PERTURBATION, *rest))


LAYOUTS = ("A", "B", "C", "D", "E", "F")  # of the main table; further ones may have a name, too
SEEDS = tuple(range(10))
VARIED: dict[str, Any] = {"layout": ("A", "D"), "seed": tuple(range(5))}  # one open, one closing
MAIN_TABLE = "main"
IMITATING = tuple(name for name in PAPER if LEARNERS[name].network)


@dataclass(frozen=True)
class Variant:
    """One field with another value; all other fields are the main table's."""

    departure: str  #: its letter in `DEPARTURES`; "" where the main table follows the paper
    changed: str  #: the difference in words
    fields: Mapping[str, Any]
    learners: tuple[str, ...] = PAPER


def _variants() -> dict[str, Variant]:
    found = {}
    for decay, rates in {"step": (0.9, 0.999, 0.9999), "episode": (0.95, 0.98, 0.995)}.items():
        for rate in rates:
            changed = f"c_epsilon = {rate:g} per {decay}"
            found[changed] = Variant("C", changed, {"decay": decay, "decay_rate": rate})
    found |= {
        "printed box": Variant("A", "the box as printed, [-9, 3]^2", {"box": "printed"}),
        "soft box": Variant("M", "the box as soft as the obstacles", {"box": "soft"}),
        "no clipping": Variant("E", "actions may leave the action space", {"clipped": False}),
        "Q(s, a)": Variant("F", "u_0 = a fixed where the value is learned", {"constrained": True}),
        "literal": Variant("G", "theta moves from step 1", {"gated": False}, IMITATING),
        "other side of the kink": Variant("L", "ties count as active", {"ties_active": True}),
    }
    for network in ("normalised", "tanh", "small buffer", "four fits"):
        found[network] = Variant("H", f"network: {network}", {"network": network}, IMITATING)
    for factor in (0.1, 10, 100):
        changed = f"beta x {factor:g}"
        found[changed] = Variant("J", changed, {"beta": factor * paper.BETA}, ("GES",))
    for factor in (0.1, 0.3, 3):
        changed = f"alpha x {factor:g}"
        found[changed] = Variant("", changed, {"alpha": factor * paper.ALPHA})
    for horizon in (5, 20):
        found[f"N = {horizon}"] = Variant("", f"horizon N = {horizon}", {"horizon": horizon})
    found["tolerance 1e-5"] = Variant("", "a looser solver", {"tolerance": 1e-5})
    theta = perturbed(Experiment()).theta
    found["perturbed"] = Variant("", "theta_init moved by 1e-12", {"theta": theta})
    for network, changed in {  # readings of DES
        "lagged": "a copy of the network, refreshed once an episode, predicts",
        "averaged": "a copy that follows the network slowly predicts",
        "greedy": "the next action is the network's minimiser",
        "late": "the network is one fit late, as in parallel",
    }.items():
        fields = {"network": network, "layout": LAYOUTS, "decay": tuple(DECAYS)}
        found[network] = Variant("I", changed, fields, ("DES",))
    return found


VARIANTS = _variants()


def main_table(
    learners: Sequence[str] = MAIN,
    layouts: Sequence[Any] = LAYOUTS,
    seeds: Sequence[int] = SEEDS,
    episodes: int = paper.EPISODES,
    decays: Sequence[str] = tuple(DECAYS),
) -> tuple[Experiment, ...]:
    """Every learner in every layout, in both readings of the decay, with every seed."""
    return sweep(learner=learners, layout=layouts, decay=decays, seed=seeds, episodes=episodes)


def controls() -> tuple[Experiment, ...]:
    """The runs of learners that only some questions need: matched, random and Q-learning."""
    return sweep(learner=("matched", "random", "QL"), decay=tuple(DECAYS), **VARIED)


def variant(name: str) -> tuple[Experiment, ...]:
    """The runs of one variant, and the baselines with a frozen theta."""
    one = VARIANTS[name]
    runs = sweep(learner=one.learners, **VARIED | dict(one.fields))
    return (*runs, *dict.fromkeys(map(frozen_arm, runs)))


def whole_study() -> dict[Experiment, str]:
    """Every run of the study with the name of the first part that has it."""
    parts = {MAIN_TABLE: main_table(), "controls": controls()}
    parts |= {name: variant(name) for name in VARIANTS}
    named: dict[Experiment, str] = {}
    for name, runs in parts.items():
        for experiment in runs:
            named.setdefault(experiment, name)
    return named
