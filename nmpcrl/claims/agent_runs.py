"""The runs of SAC and TD3: which are wanted, and what is there of them.

The tuning comes before the other parts. All are kept by `analysis.agent_curves`, so that an
interrupted call goes on.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis import kept
from nmpcrl.analysis.agent_curves import KEPT, Curve, curve
from nmpcrl.analysis.agents import ENTRIES, require
from nmpcrl.analysis.agents import agent as agent_named
from nmpcrl.analysis.kept import Wanted
from nmpcrl.analysis.suite import HELD_OUT, LAYOUTS, entry
from nmpcrl.analysis.suite import seed_of as seed_in
from nmpcrl.claims import agent_published
from nmpcrl.claims.agent_published import order
from nmpcrl.claims.agent_questions import AGENTS, EVERY, LONG, PARTS, SETTINGS, SPARING
from nmpcrl.claims.extendable import whole_arms
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.geometry import Centres
from nmpcrl.study.storage.refusal import Refusal

TUNING = "tune"  # the part that comes before the others
ORDER = tuple(PARTS)
SECONDS: Mapping[str, float] = {"SAC": 0.0065, "TD3": 0.0027}  # of a gradient step
ELSE, ROLLOUT = 0.05, 0.03  # seconds of the rest of an episode, and of a rollout that judges


class NotTuned(Refusal):
    """An agent cannot be judged before its tuning."""


def trained_in(place: str) -> dict[str, Centres]:
    """The layouts of a place."""
    return dict(TUNE) if place == EVERY else {place: LAYOUTS[place]}


def judged_in(place: str) -> dict[str, Centres]:
    """Where its policy is judged: an agent for all also in layouts that it never saw."""
    return {**TUNE, **JUDGE} if place == EVERY else trained_in(place)


def seed_of(place: str, k: int) -> int:
    """The seed number k of a place; of a layout it is that of the suite."""
    return 6 * HELD_OUT + k if place == EVERY else seed_in(place, k)


def settings(agent: str) -> tuple[str, ...]:
    """The names that an agent has in its tuning, that of the one it ships with first."""
    return tuple(str(ENTRIES[agent].with_settings(**one)) for one in SETTINGS[agent])


def chosen(agent: str) -> str:
    """The agent with its best setting, that of the least mean of J / J_init.

    Raises:
        NotTuned: its tuning is neither kept whole nor published.
        Damaged: what is published is not what was written.
    """
    names = settings(agent)
    runs = {name: KEPT.stored(_runs(TUNING, [name])).values() for name in names}
    costs = {name: [each.costs[-1][0] / each.initial[0] for each in runs[name]] for name in names}
    if any(len(each) < len(order(TUNING)) for each in costs.values()):
        costs = _published(names)
    if not all(costs.values()):
        raise NotTuned(f"{agent} is not tuned yet: `nmpcrl agents --part tune` does that")
    return min(costs, key=lambda name: float(np.mean(costs[name])))


def _published(names: Iterable[str]) -> dict[str, list[float]]:
    """J / J_init of the published tuning; nothing where it is not published."""
    there = agent_published.load().table if agent_published.HELD.path.exists() else None
    tuned = {} if there is None else dict(iter(there[there.part == TUNING].groupby("arm")))
    return {
        name: [costs[-1][0] / initial[0] for costs, initial in
               zip(tuned[name].costs, tuned[name].initial, strict=True)] if name in tuned else []
        for name in names
    }  # fmt: skip


def sparing(name: str) -> str:
    """An agent with its setting, but at most `SPARING` gradient steps a step."""
    made = entry(name, ENTRIES)
    gradient = min(made.settings["gradient"], SPARING)
    return str(made.with_settings(gradient=gradient))


def wanted(part: str) -> tuple[Wanted, ...]:
    """All runs of a part.

    Raises:
        NotTuned: as `chosen`, of a part in which agents are judged.
    """
    if part == TUNING:
        return _runs(part, [name for agent in AGENTS for name in settings(agent)])
    names = [chosen(agent) for agent in AGENTS]
    return _runs(part, [sparing(name) if part in LONG else name for name in names])


def planned(part: str) -> tuple[Wanted, ...]:
    """As `wanted`; of agents that are not tuned yet as they ship."""
    try:
        return wanted(part)
    except NotTuned:
        return _runs(part, [sparing(name) if part in LONG else name for name in AGENTS])


def _runs(part: str, names: Iterable[str]) -> tuple[Wanted, ...]:
    one = PARTS[part]
    return tuple(
        Wanted(f"{part}: {name}", one.budget, place, seed_of(place, k))
        for name in names
        for place, k in order(part)
    )


def run(one: Wanted) -> Curve:
    """Carry out one."""
    part, _, name = one.entry.partition(": ")
    where = trained_in(one.layout), judged_in(one.layout)
    return curve(name, *where, PARTS[part].checkpoints, one.seed)


def run_parts(parts: Iterable[str], **options: Any) -> None:
    """Run what is missing, part by part; options as `Kept.complete` takes them.

    Raises:
        NoAgents: stable-baselines3 is not installed.
        NotTuned: as `wanted`.
    """
    for part in sorted(parts, key=ORDER.index):
        KEPT.complete(
            wanted(part),
            run,
            before=lambda _: require(),
            said=lambda one, made: f"{one.entry} in {one.layout}: {_share(made):.0%}",
            **options,
        )


def _share(made: Curve) -> float:
    """The median over layouts of the cost at the end, in parts of theta_init's."""
    return float(np.median(np.array(made.costs[-1]) / np.array(made.initial)))


def whole(parts: Iterable[str] = ORDER) -> pd.DataFrame:
    """The table of all that is kept of some parts, but arms that are not there whole."""
    runs = (one for part in parts for one in planned(part))
    return whole_arms(KEPT, runs, seed_of)


def price(runs: Iterable[Wanted], measured: Mapping[Wanted, Curve]) -> float:
    """Seconds of processor time that some runs take, by those that are known of the same arm."""
    return kept.price(runs, measured, alike=lambda one: one.entry, otherwise=_seconds)


def _seconds(one: Wanted) -> float:
    part, _, name = one.entry.partition(": ")
    made = agent_named(name)
    gradient = made.values["gradient"] * paper.STEPS
    judged = len(judged_in(one.layout)) * len(PARTS[part].checkpoints) * ROLLOUT
    return one.budget * (gradient * SECONDS[made.name] + ELSE) + judged
