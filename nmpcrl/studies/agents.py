"""SAC and TD3, which learn without an NMPC, beside the best search over theta: 17 questions.

Settings, parts and questions, in `agents.toml`, were committed before any agent was tuned or
judged; a test compares them with that commit, whose file also has the measure of each question and
its border.

Of four settings of an agent, the one with the least mean of J / J_init in three layouts is judged.
It **matches** theta_init where its rollout without noise costs no more, and **solves** a layout
where it also ends at the target.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import suite
from nmpcrl.analysis.suite import HELD_OUT, TOLERANCE, Entry, entry
from nmpcrl.studies.agents_run import EVERY, SAC, TD3, THERE, curve, judged_in, require
from nmpcrl.studies.investigation import Answer, Investigation, Part, cheaper, questions, share
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.provenance import EPOCHS
from nmpcrl.study.refusal import Refusal

AGENTS: Mapping[str, Entry] = {"SAC": SAC, "TD3": TD3}
_SETTINGS: tuple[Mapping[str, float], ...] = ({}, {"turn": 0.5}, {"gradient": 0.5, "width": 128})
SETTINGS: Mapping[str, tuple[Mapping[str, float], ...]] = {  # the default first
    "SAC": (*_SETTINGS, {"reward": 0.01}),
    "TD3": (*_SETTINGS, {"reward": 0.1}),
}
SPARING = 0.5  # gradient steps a step of the robot, at most, in "one" and "all"
SEARCH, SEARCHED = "Bayes", ("judge 50", "named 50")  # the best search, in these published parts
RESAMPLES = 2000  # of the bootstrap over layouts or seeds
Known: TypeAlias = tuple[pd.DataFrame, pd.DataFrame]  # of `SAC_AND_TD3`, and of `REMEDIES`

CHECKPOINTS: Mapping[str, tuple[int, ...]] = {  # episodes after which the policy is judged
    "tune": (150,),
    "judge": (25, 50, 100, 150, 200, 250, 300),
    "one": (25, 50, 100, 150, 200, 300, 400, 500, 600),
    "all": (50, 100, 200, 300, 500, 750, 1000, 1250, 1600),
}


def arms(name: str) -> dict[str, Entry]:
    """An agent with each of its settings, the default first."""
    every = (AGENTS[name].with_settings(**setting) for setting in SETTINGS[name])
    return {str(one): one for one in every}


def tuned(table: pd.DataFrame, name: str) -> Entry:
    """An agent with its best setting: the least mean of J / J_init; of equal ones the first."""
    tune = table[table.part == "tune"]
    costs = {
        arm: [run.costs[-1][0] / run.initial[0] for run in tune[tune.arm == arm].itertuples()]
        for arm in arms(name)
    }
    if min(map(len, costs.values())) < len(PARTS["tune"].places):
        raise Refusal(f"{name} is not tuned yet: the part 'tune' comes first")
    return arms(name)[min(costs, key=lambda arm: float(np.mean(costs[arm])))]


def _tuned(most: float, table: pd.DataFrame) -> dict[str, Entry]:
    """The tuned agents, with at most so many gradient steps a step of the robot."""
    best = [tuned(table, name) for name in AGENTS]
    every = (one.with_settings(gradient=min(one.settings["gradient"], most)) for one in best)
    return {str(one): one for one in every}


def _part(name: str, arms: Any, places: Sequence[str], seeds: int = 1) -> Part:
    checkpoints = CHECKPOINTS[name]
    return Part(partial(curve, checkpoints), arms, places, checkpoints[-1], seeds, seconds=0.6)


PARTS = {
    "tune": _part("tune", {**arms("SAC"), **arms("TD3")}, ("T01", "T02", "T03")),
    "judge": _part("judge", partial(_tuned, np.inf), tuple(f"J{i:03}" for i in range(1, 7))),
    "one": _part("one", partial(_tuned, SPARING), ("A",), 4),
    "all": _part("all", partial(_tuned, SPARING), (EVERY,), 2),
}


def seed_of(place: str, k: int) -> int:
    """The k-th seed of a place; in one layout the seed of the suite."""
    return 6 * HELD_OUT + k if place == EVERY else suite.seed_of(place, k)


@dataclass(frozen=True, eq=False)
class Course:
    """The costs of an agent during training, over theta_init's cost."""

    shares: pd.DataFrame  # a row a checkpoint; a column a layout, or in part "one" a seed
    there: pd.DataFrame  # whether the robot arrives, under every seed, as `shares`

    @property
    def episodes(self) -> list[int]:
        """Episodes before each checkpoint."""
        return [*self.shares.index]

    @property
    def last(self) -> pd.Series:
        """The shares at the last checkpoint."""
        return self.shares.iloc[-1]

    @property
    def median(self) -> Vector:
        """The median share over layouts or seeds, at each checkpoint."""
        found: Vector = np.median(self.shares, axis=1)
        return found

    @property
    def interval(self) -> Matrix:
        """Ends of the median's interval of 95 %, by a bootstrap over the columns."""
        rng, units = np.random.default_rng(0), self.shares.shape[1]
        drawn = self.shares.to_numpy()[:, rng.integers(units, size=(RESAMPLES, units))]
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

    @property
    def numbers(self) -> dict[str, float]:
        """The median at the end, and when it matches theta_init; empty without runs."""
        if self.shares.empty:
            return {}
        first, always = self.matched
        return {"median": float(self.median[-1]), "matches first": first, "matches from": always}


def rows_of(table: pd.DataFrame, part: str, agent: str) -> pd.DataFrame:
    """The rows of an agent in a part, with any setting."""
    there = table[table.part == part]
    return there[[entry(arm, AGENTS).name == agent for arm in there.arm]]


def course(table: pd.DataFrame, part: str, agent: str, among: Sequence[str] = ()) -> Course:
    """The course of an agent in a part, in all layouts or `among` some; empty without runs."""
    points = CHECKPOINTS[part]
    shares, there = [pd.DataFrame(index=points)], [pd.DataFrame(index=points)]
    for run in rows_of(table, part, agent).itertuples():
        units = [str(run.k)] if part == "one" else [*judged_in(run.place)]
        shares.append(pd.DataFrame(np.array(run.costs) / run.initial, points, units))
        there.append(pd.DataFrame([[*one] for one in run.arrived], points, units) == THERE)
    mean, every = (pd.concat(one, axis=1).T.groupby(level=0, sort=False) for one in (shares, there))
    found = (mean.mean().astype(float).T, every.all().astype(bool).T)
    return Course(*(one[[*among]] if among and len(one.T) else one for one in found))


def _matches(one: Course, _: pd.Series) -> Answer:
    return share(one.last <= 1 + TOLERANCE, numbers=one.numbers)


def _less(one: Course, search: pd.Series) -> Answer:
    return cheaper((one.last / search.astype(float)).dropna())


# answer of a course and of the costs of the search; part, and some of its layouts
_ASKED: Mapping[str, tuple[Callable[..., Answer], str, Sequence[str]]] = {
    "matches in 300 episodes": (_matches, "judge", ()),
    "solves in 300 episodes": (lambda one, _: share(
        (one.last <= 1 + TOLERANCE) & one.there.iloc[-1].astype(bool)), "judge", ()),
    "or the best search": (_less, "judge", ()),
    "matches in one layout": (lambda one, _: share(
        one.shares.min() <= 1 + TOLERANCE, "seeds", one.numbers), "one", ()),
    "or the best search in one layout": (lambda one, search: cheaper(  # each seed beside its mean
        (one.last / search.get("A", np.nan)).dropna(), "seeds"), "one", ()),
    "matches over the 60": (_matches, "all", [*TUNE]),
    "matches on the 120": (_matches, "all", [*JUDGE]),
    "or the best search on the 120": (_less, "all", [*JUDGE]),
}  # fmt: skip


def _of_agent(
    agent: str, judge: Callable[..., Answer], part: str, among: Sequence[str], known: Known
) -> Answer:
    """The answer of the course of an agent in a part, in all layouts or `among` some."""
    table, compared = known
    return judge(course(table, part, agent, among), searched(compared, SEARCHED[part == "one"]))


def _one_or_other(known: Known) -> Answer:
    first, second = (course(known[0], "judge", name).last for name in AGENTS)
    return cheaper((first / second).dropna())


QUESTIONS = questions(__file__, {
    **{f"{agent} {name}": partial(_of_agent, agent, *of)
       for agent in AGENTS for name, of in _ASKED.items()},
    "SAC or TD3": _one_or_other,
})  # fmt: skip


def searched(compared: pd.DataFrame, part: str) -> pd.Series:
    """The cost of the best search in each layout of a part, over theta_init's cost."""
    runs = compared[(compared.part == part) & (compared.entry == SEARCH)]
    return (runs.cost / runs.initial).groupby(runs.place, sort=False).mean()


SAC_AND_TD3 = Investigation(
    name="agents",
    parts=PARTS,
    questions=QUESTIONS,
    seed=seed_of,
    registered="2feab64",
    epochs=dict.fromkeys(EPOCHS, 1),  # later ones are of solves and learners that no agent uses
    libraries=("cma", "optuna", "stable-baselines3"),
    digits=6,
    evidence=lambda table: (table, REMEDIES.table()),
    prepare=lambda missing: require(),
)
