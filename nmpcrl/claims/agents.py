"""What SAC and TD3 come to, by the definitions of `agent_questions`.

All of it is made of one table, a row a training, with `agent_published.COLUMNS`. What is missing is
left out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.agent_curves import THERE
from nmpcrl.analysis.suite import TOLERANCE
from nmpcrl.claims import remedies
from nmpcrl.claims.agent_questions import (
    AGENT_QUESTIONS,
    AGENTS,
    EVERY,
    PARTS,
    SEARCH,
    SEARCHED,
)
from nmpcrl.claims.agent_runs import judged_in
from nmpcrl.claims.population import Answer, by_share
from nmpcrl.study.drawn import JUDGE, TUNE

RESAMPLES = 2000  # of the bootstrap over layouts or seeds


@dataclass(frozen=True, eq=False)
class Course:
    """What an agent costs while it is trained, in parts of theta_init's."""

    agent: str
    units: tuple[str, ...]  # layouts, or where it is trained in one its seeds
    episodes: tuple[int, ...]  # of each checkpoint
    shares: Matrix  # shape (checkpoints, units)
    there: Matrix  # whether the robot arrives, under every seed, as `shares`

    @property
    def median(self) -> Vector:
        """Over the units, at each checkpoint."""
        found: Vector = np.median(self.shares, axis=1)
        return found

    @property
    def interval(self) -> Matrix:
        """Of the median, of 95 %, by a bootstrap over the units; shape (2, checkpoints)."""
        rng, units = np.random.default_rng(0), len(self.units)
        drawn = self.shares[:, rng.integers(units, size=(RESAMPLES, units))]
        ends: Matrix = np.quantile(np.median(drawn, axis=2), [0.025, 0.975], axis=1)
        return ends

    @property
    def matched(self) -> tuple[float, float]:
        """Episodes after which the median matches theta_init first, and from then on always."""
        yes = self.median <= 1 + TOLERANCE
        last = np.flatnonzero(~yes)
        stays = last[-1] + 1 if last.size else 0
        first = float(self.episodes[int(yes.argmax())]) if yes.any() else np.inf
        return first, float(self.episodes[stays]) if stays < len(yes) else np.inf


def course(table: pd.DataFrame, part: str, agent: str, among: Sequence[str] = ()) -> Course | None:
    """How an agent did in a part; None where that is not known.

    Args:
        table: with `agent_published.COLUMNS`.
        part: one of those in which agents are judged.
        agent: with whatever setting.
        among: of an agent for all the layouts to look at.
    """
    runs = table[(table.part == part) & (agents_of(table) == agent)]
    if runs.empty:
        return None
    shares = np.array(
        [np.array(row.costs) / np.array(row.initial) for row in runs.itertuples()]
    )  # run, checkpoint, layout
    there = np.array([[[*one] for one in row.arrived] for row in runs.itertuples()]) == THERE
    episodes = PARTS[part].checkpoints
    if runs.place.iloc[0] != EVERY:
        one_seed = len({*runs.k}) == 1
        units = tuple(
            str(place if one_seed else k) for place, k in zip(runs.place, runs.k, strict=True)
        )
        return Course(agent, units, episodes, shares[:, :, 0].T, there[:, :, 0].T)
    known = [*judged_in(EVERY)]
    some = [known.index(name) for name in among or known]
    mean, each = shares.mean(axis=0), there.all(axis=0)
    return Course(agent, tuple(among or known), episodes, mean[:, some], each[:, some])


def answers(table: pd.DataFrame, suite: pd.DataFrame | None = None) -> tuple[Answer, ...]:
    """All questions of `AGENT_QUESTIONS`.

    Args:
        table: with `agent_published.COLUMNS`.
        suite: the published comparison of remedies; what asks for it is not decidable without.
    """
    found = [one for agent in AGENTS for one in _answers(table, suite, agent)]
    first, second = (course(table, "judge", agent) for agent in AGENTS)
    pair = pd.DataFrame({one.agent: _last(one) for one in (first, second) if one}, columns=AGENTS)
    both = pair.dropna()
    ratio = both[AGENTS[0]] / both[AGENTS[1]]
    found.append(by_share("SAC or TD3", ratio < 1, "layouts", {"median ratio": _median(ratio)}))
    by = {one.question: one for one in found}
    return tuple(by[name] for name in AGENT_QUESTIONS)


def _answers(table: pd.DataFrame, suite: pd.DataFrame | None, agent: str) -> Iterator[Answer]:
    """What is asked of one agent."""
    judged, one = course(table, "judge", agent), course(table, "one", agent)
    seen, unseen = (course(table, "all", agent, [*each]) for each in (TUNE, JUDGE))
    short, named = (searched(suite, part) for part in SEARCHED)
    matches = _last(judged) <= 1 + TOLERANCE
    yield by_share(f"{agent} matches in 300 episodes", matches, "layouts", _median_of(judged))
    yield by_share(f"{agent} solves in 300 episodes", matches & _there(judged), "layouts")
    yield _against(f"{agent} or the best search", judged, short, "layouts")
    best = one.shares.min(axis=0) if one else []
    yield by_share(
        f"{agent} matches in one layout",
        pd.Series(best, dtype=float) <= 1 + TOLERANCE, "seeds", _median_of(one),
    )  # fmt: skip
    there = named.reindex(PARTS["one"].places)
    in_one = pd.Series(there.iloc[0], index=one.units if one else [], dtype=float)
    yield _against(f"{agent} or the best search in one layout", one, in_one, "seeds")
    for name, each in (("over the 60", seen), ("on the 120", unseen)):
        yes = _last(each) <= 1 + TOLERANCE
        yield by_share(f"{agent} matches {name}", yes, "layouts", _median_of(each))
    yield _against(f"{agent} or the best search on the 120", unseen, short, "layouts")


def searched(suite: pd.DataFrame | None, part: str) -> pd.Series:
    """What the best search costs in each layout of a part, in parts of theta_init's."""
    if suite is None:
        return pd.Series(dtype=float)
    runs = suite[(suite.part == part) & (suite.entry == SEARCH)]
    return (runs.cost / runs.initial).groupby(runs.layout, sort=False).mean()


def rows(table: pd.DataFrame, suite: pd.DataFrame) -> tuple[remedies.RemedyRow, ...]:
    """The agents' rows of the suite with 300 episodes, in the layouts in which they are judged.

    Args:
        table: with `agent_published.COLUMNS`.
        suite: the published comparison, which has J_best of each layout.
    """
    best = suite.groupby("layout").best.first()
    runs = table[(table.part == "judge") & table.place.isin(best.index)]
    last = pd.DataFrame(
        {
            "entry": agents_of(runs),
            "name": runs.arm,
            "layout": runs.place,
            "initial": [each[0] for each in runs.initial],
            "best": runs.place.map(best),
            "cost": [each[-1][0] for each in runs.costs],
            "arrived": [each[-1] == THERE for each in runs.arrived],
            "episodes": runs.episodes,
            "over": runs.episodes > PARTS["judge"].budget,
            "seconds": runs.seconds,
        }
    )
    there = (last[last.entry == agent] for agent in AGENTS)
    agents = (one for one in there if len(one))
    return tuple(remedies.row("judge 300", str(one.entry.iloc[0]), one) for one in agents)


def agents_of(table: pd.DataFrame) -> pd.Series:
    """The agent of each run, with whatever setting."""
    return table.arm.map(lambda arm: arm.partition("[")[0])


def _last(one: Course | None) -> pd.Series:
    """The shares at the end."""
    return pd.Series(dtype=float) if one is None else pd.Series(one.shares[-1], one.units)


def _there(one: Course | None) -> pd.Series:
    """Whether the robot arrives at the end."""
    return pd.Series(dtype=bool) if one is None else pd.Series(one.there[-1], one.units)


def _median(values: pd.Series) -> float:
    return float(values.median()) if len(values) else np.nan


def _median_of(one: Course | None) -> dict[str, float]:
    """When the median matches theta_init, and what it is at the end."""
    if one is None:
        return {}
    first, always = one.matched
    return {"median": float(one.median[-1]), "matches first": first, "matches from": always}


def _against(name: str, one: Course | None, other: pd.Series, of: str) -> Answer:
    """Whether an agent costs less at the end than something else does, where both are known."""
    both = pd.DataFrame({"agent": _last(one), "other": other}).dropna()
    if one is not None:
        both = both.loc[[unit for unit in one.units if unit in both.index]]
    ratio = both["agent"] / both["other"]
    return by_share(name, ratio < 1, of, {"median ratio": _median(ratio)})
