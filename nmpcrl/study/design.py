"""The design of the study: which runs decide the claims, and what each part is called.

The main table varies what the paper leaves open and no single value can be chosen for: layout,
reading of the exploration decay, and seed. The variants change one other thing at a time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from types import MappingProxyType
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import MAIN, PAPER, Experiment, frozen_arm
from nmpcrl.study.learners import DECAYS, LEARNERS
from nmpcrl.study.replicas import perturbed
from nmpcrl.study.sweeps import sweep

LAYOUTS = ("A", "B", "C", "D", "E", "F")  # of the main table; further ones may have a name, too
SEEDS = tuple(range(10))
VARIED: dict[str, Any] = {"layout": ("A", "D"), "seed": tuple(range(5))}  # one open, one closing
# What a build trains again: all learners, in the chapters' layout in both readings and with as many
# seeds as `claims.reproduce.FEWEST`, and in every other layout in one reading and with one seed.
FRESH: tuple[dict[str, Any], ...] = (
    {"layouts": ("A",), "seeds": (0, 1, 2)},
    {"layouts": ("B", "E"), "decays": ("step",), "seeds": (0,)},
    {"layouts": ("C", "D", "F"), "decays": ("episode",), "seeds": (0,)},
)
MAIN_TABLE = "main"
IMITATING = tuple(name for name in PAPER if LEARNERS[name].network)
BASELINES = {  # what the paper leaves open of DES, on every layout and in both readings
    "lagged": "a copy of the network, refreshed once an episode, predicts",
    "averaged": "a copy that follows the network slowly predicts",
    "greedy": "the next action is the network's minimiser",
    "late": "the network is one fit late, as in parallel",
}


@dataclass(frozen=True)
class Variant:
    """One thing read otherwise, all else as in the main table."""

    departure: str  # its letter in `DEPARTURES`, or "" where the paper is followed elsewhere
    changed: str  # in words
    fields: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
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
    for network, changed in BASELINES.items():
        fields = {"network": network, "layout": LAYOUTS, "decay": tuple(DECAYS)}
        found[network] = Variant("I", changed, fields, ("DES",))
    return found


VARIANTS = _variants()


def main_table(
    learners: Sequence[str] = MAIN,
    layouts: Sequence[str] = LAYOUTS,
    seeds: Sequence[int] = SEEDS,
    episodes: int = paper.EPISODES,
    decays: Sequence[str] = tuple(DECAYS),
) -> tuple[Experiment, ...]:
    """Every learner in every layout, in both readings of the decay, with every seed."""
    return sweep(learner=learners, layout=layouts, decay=decays, seed=seeds, episodes=episodes)


def fresh(episodes: int = paper.EPISODES) -> tuple[Experiment, ...]:
    """The part of the main table that `make book` trains on the reader's machine."""
    parts = (main_table(**part, episodes=episodes) for part in FRESH)
    return tuple(dict.fromkeys(chain.from_iterable(parts)))


def controls(episodes: int = paper.EPISODES) -> tuple[Experiment, ...]:
    """Learners that only some cells need: matched steps, random directions, and Q-learning."""
    return sweep(
        learner=("matched", "random", "QL"), decay=tuple(DECAYS), episodes=episodes, **VARIED
    )


def variant(name: str, episodes: int = paper.EPISODES) -> tuple[Experiment, ...]:
    """The runs of one variant, with the frozen arms that they are compared with."""
    one = VARIANTS[name]
    runs = sweep(learner=one.learners, episodes=episodes, **VARIED | dict(one.fields))
    return (*runs, *dict.fromkeys(map(frozen_arm, runs)))


def whole_study(episodes: int = paper.EPISODES) -> dict[Experiment, str]:
    """Every run of the study with the part that it belongs to, the main table first.

    A run that two parts share is named after the first.
    """
    parts = {MAIN_TABLE: main_table(episodes=episodes), "controls": controls(episodes)}
    parts |= {name: variant(name, episodes) for name in VARIANTS}
    named: dict[Experiment, str] = {}
    for name, runs in parts.items():
        for experiment in runs:
            named.setdefault(experiment, name)
    return named
