"""SAC and TD3, which learn without an NMPC, beside the best search over theta: 17 questions.

Settings, parts and questions were committed before any agent was tuned or judged; a test compares
them with that commit, whose file also says what each question measures and where yes ends.

An agent has four settings, tuned in three layouts; the one with the least mean of J / J_init is
judged. It **matches** theta_init where its rollout without noise costs no more, and **solves** a
layout where it also ends at the target. A training costs most of an hour or less of one core.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import suite
from nmpcrl.analysis.suite import HELD_OUT, TOLERANCE, Entry
from nmpcrl.claims.investigation import Answer, Investigation, Part, Question, share
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Outcome
from nmpcrl.studies import remedies
from nmpcrl.studies.agents_run import EVERY, SAC, TD3, THERE, curve, judged_in, require
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.refusal import Refusal

AGENTS: Mapping[str, Entry] = {"SAC": SAC, "TD3": TD3}
_SETTINGS: tuple[Mapping[str, float], ...] = ({}, {"turn": 0.5}, {"gradient": 0.5, "width": 128})
SETTINGS: Mapping[str, tuple[Mapping[str, float], ...]] = {  # the default first
    "SAC": (*_SETTINGS, {"reward": 0.01}),
    "TD3": (*_SETTINGS, {"reward": 0.1}),
}
SPARING = 0.5  # gradient steps a step, at most, in `LONG`
LONG = ("one", "all")
SEARCH, SEARCHED = "Bayes", ("judge 50", "named 50")  # the best search, in these published parts
RESAMPLES = 2000  # of the bootstrap over layouts or seeds

CHECKPOINTS: Mapping[str, tuple[int, ...]] = {  # episodes after which the policy is judged
    "tune": (150,),
    "judge": (25, 50, 100, 150, 200, 250, 300),
    "one": (25, 50, 100, 150, 200, 300, 400, 500, 600),
    "all": (50, 100, 200, 300, 500, 750, 1000, 1250, 1600),
}


class NotTuned(Refusal):
    """An agent cannot be judged before its tuning is complete."""


def agent_of(arm: str) -> Entry:
    """The agent of an arm, with its settings."""
    return suite.entry(arm, AGENTS)


def tuned(table: pd.DataFrame, name: str) -> Entry:
    """An agent with its best setting: the least mean of J / J_init; of equal ones the first.

    Raises:
        NotTuned: a row of the tuning is missing.
    """
    known = table[table.part == "tune"]
    costs = {}
    for setting in SETTINGS[name]:
        one = AGENTS[name].with_settings(**setting)
        rows = known[known.arm == str(one)]
        if len(rows) < len(PARTS["tune"].places):
            raise NotTuned(f"{one} is not tuned yet: the part 'tune' comes first")
        each = [row.costs[-1][0] / row.initial[0] for row in rows.itertuples()]
        costs[one] = float(np.mean(each))
    return min(costs, key=lambda one: costs[one])


def _judged(table: pd.DataFrame) -> dict[str, Entry]:
    return {str(one): one for one in (tuned(table, name) for name in AGENTS)}


def _sparing(table: pd.DataFrame) -> dict[str, Entry]:
    """The tuned agents with at most `SPARING` gradient steps a step."""
    best = (tuned(table, name) for name in AGENTS)
    less = (one.with_settings(gradient=min(one.settings["gradient"], SPARING)) for one in best)
    return {str(one): one for one in less}


def _tuning() -> dict[str, Entry]:
    every = (one.with_settings(**it) for name, one in AGENTS.items() for it in SETTINGS[name])
    return {str(one): one for one in every}


def _part(name: str, arms: Any, places: Sequence[str], seeds: int = 1) -> Part:
    checkpoints = CHECKPOINTS[name]
    return Part(partial(curve, checkpoints), arms, places, checkpoints[-1], seeds, seconds=0.6)


PARTS = {
    "tune": _part("tune", _tuning(), ("T01", "T02", "T03")),
    "judge": _part("judge", _judged, tuple(f"J{i:03}" for i in range(1, 7))),
    "one": _part("one", _sparing, ("A",), 4),
    "all": _part("all", _sparing, (EVERY,), 2),
}


def seed_of(place: str, k: int) -> int:
    """The k-th seed of a place; of a layout as in the suite."""
    return 6 * HELD_OUT + k if place == EVERY else suite.seed_of(place, k)


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
    """How an agent did in a part; None where it is not known.

    Args:
        table: of `SAC_AND_TD3`.
        part: in which agents are judged.
        agent: its name.
        among: layouts to look at, of an agent for all.
    """
    runs = table[(table.part == part) & (agents_of(table) == agent)]
    if runs.empty:
        return None
    shares = np.array(
        [np.array(row.costs) / np.array(row.initial) for row in runs.itertuples()]
    )  # run, checkpoint, layout
    there = np.array([[[*one] for one in row.arrived] for row in runs.itertuples()]) == THERE
    episodes = CHECKPOINTS[part]
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


def _matches(part: str, among: Sequence[str] = ()) -> Callable[..., Answer]:
    def answer(agent: str, table: pd.DataFrame, compared: pd.DataFrame) -> Answer:
        one = course(table, part, agent, among)
        return share(_last(one) <= 1 + TOLERANCE, "layouts", _median_of(one))

    return answer


def _solves(agent: str, table: pd.DataFrame, compared: pd.DataFrame) -> Answer:
    one = course(table, "judge", agent)
    return share((_last(one) <= 1 + TOLERANCE) & _there(one), "layouts")


def _matches_once(agent: str, table: pd.DataFrame, compared: pd.DataFrame) -> Answer:
    one = course(table, "one", agent)
    best = pd.Series(one.shares.min(axis=0) if one else [], dtype=float)
    return share(best <= 1 + TOLERANCE, "seeds", _median_of(one))


def _against(part: str, among: Sequence[str] = ()) -> Callable[..., Answer]:
    """Whether an agent costs less at the end than the search does, where both are known."""

    def answer(agent: str, table: pd.DataFrame, compared: pd.DataFrame) -> Answer:
        one = course(table, part, agent, among)
        other = searched(compared, SEARCHED[part == "one"])
        if part == "one":  # each seed beside the mean of the search in this layout
            there = other.reindex(PARTS[part].places).iloc[0]
            other = pd.Series(there, index=one.units if one else [], dtype=float)
        both = pd.DataFrame({"agent": _last(one), "other": other}).dropna()
        if one is not None:
            both = both.loc[[unit for unit in one.units if unit in both.index]]
        ratio = both["agent"] / both["other"]
        unit = "seeds" if part == "one" else "layouts"
        return share(ratio < 1, unit, {"median ratio": _median(ratio)})

    return answer


def _one_or_other(table: pd.DataFrame, compared: pd.DataFrame) -> Answer:
    found = {name: course(table, "judge", name) for name in AGENTS}
    last = {name: _last(one) for name, one in found.items() if one}
    both = pd.DataFrame(last, columns=[*AGENTS]).dropna()
    ratio = both["SAC"] / both["TD3"]
    return share(ratio < 1, "layouts", {"median ratio": _median(ratio)})


# name, question, expected of SAC and of TD3, answer
_ASKED: Sequence[tuple[str, str, Outcome, Outcome, Callable[..., Answer]]] = (
    ("matches in 300 episodes", "Does {} match theta_init with 300 episodes?",
     PARTLY, PARTLY, _matches("judge")),
    ("solves in 300 episodes", "Does {} solve the layout with 300 episodes?", NOT, NOT, _solves),
    ("or the best search", "Does {} with 300 episodes cost less than Bayes with 50?",
     NOT, NOT, _against("judge")),
    ("matches in one layout", "Does {} match theta_init within 600 episodes in layout A?",
     REPRODUCED, REPRODUCED, _matches_once),
    ("or the best search in one layout",
     "Does {} with 600 episodes cost less in A than Bayes with 50?", NOT, NOT, _against("one")),
    ("matches over the 60",
     "Does one {} for all match theta_init in the layouts it was trained in?",
     PARTLY, PARTLY, _matches("all", [*TUNE])),
    ("matches on the 120",
     "Does one {} for all match theta_init in layouts that it has never seen?",
     NOT, NOT, _matches("all", [*JUDGE])),
    ("or the best search on the 120",
     "Does one {} for all cost less, in layouts never seen, than Bayes with 50 there?",
     NOT, NOT, _against("all", [*JUDGE])),
)  # fmt: skip


def questions(compared: pd.DataFrame | None = None) -> tuple[Question, ...]:
    """The questions, answered beside a comparison of remedies; by default the published one."""

    def beside(answer: Callable[..., Answer]) -> Callable[[pd.DataFrame], Answer]:
        def answered(table: pd.DataFrame) -> Answer:
            known = remedies.REMEDIES.table() if compared is None else compared
            return answer(table, known)

        return answered

    asked = (
        Question(f"{agent} {name}", text.format(agent), both[i], beside(partial(answer, agent)))
        for i, agent in enumerate(AGENTS)
        for name, text, *both, answer in _ASKED
    )
    last = "Does SAC cost less than TD3 with 300 episodes each?"
    return (*asked, Question("SAC or TD3", last, PARTLY, beside(_one_or_other)))


def answers(table: pd.DataFrame, compared: pd.DataFrame) -> dict[str, Answer]:
    """The answers beside a comparison of remedies, by the names of the questions."""
    return replace(SAC_AND_TD3, questions=questions(compared)).answers(table)


def searched(compared: pd.DataFrame, part: str) -> pd.Series:
    """What the best search costs in each layout of a part, in parts of theta_init's."""
    runs = compared[(compared.part == part) & (compared.entry == SEARCH)]
    return (runs.cost / runs.initial).groupby(runs.place, sort=False).mean()


def rows(table: pd.DataFrame, compared: pd.DataFrame) -> tuple[remedies.RemedyRow, ...]:
    """The agents' rows of the suite with 300 episodes, in the layouts in which they are judged.

    Args:
        table: of `SAC_AND_TD3`.
        compared: the published comparison, which has J_best of each layout.
    """
    best = compared.groupby("place").best.first()
    runs = table[(table.part == "judge") & table.place.isin(best.index)]
    last = pd.DataFrame(
        {
            "entry": agents_of(runs),
            "arm": runs.arm,
            "place": runs.place,
            "initial": [each[0] for each in runs.initial],
            "best": runs.place.map(best),
            "cost": [each[-1][0] for each in runs.costs],
            "arrived": [each[-1] == THERE for each in runs.arrived],
            "episodes": runs.episodes,
            "over": runs.episodes > PARTS["judge"].episodes,
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


SAC_AND_TD3 = Investigation(
    name="agents",
    parts=PARTS,
    questions=questions(),
    seed=seed_of,
    registered="2feab64",
    libraries=("cma", "optuna", "stable-baselines3"),
    digits=6,
    prepare=lambda missing: require(),
)
