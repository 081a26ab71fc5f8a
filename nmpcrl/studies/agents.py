"""SAC and TD3, which learn without an NMPC, beside the best search over theta: 17 questions.

The agents of stable-baselines3 observe the state of the robot, its target and the centres of the
obstacles, and after each step the cost. They know no model, nor the size of an obstacle.

Settings, parts and questions, in `agents.toml`, were committed before any agent was tuned or
judged; a test compares them with that commit, whose file also has the measure of each question and
its border.

Of four settings of an agent, the one with the least mean of J / J_init in three layouts is judged.
It **matches** theta_init where its rollout without noise costs no more, and **solves** a layout
where it also ends at the target.
"""

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import gymnasium
import numpy as np
import pandas as pd
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import suite
from nmpcrl.analysis.suite import THETA, TOLERANCE, Entry, Policy, Robot, entry, followed
from nmpcrl.studies.investigation import Answer, Investigation, Part, Row, cheaper, questions, share
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.provenance import EPOCHS
from nmpcrl.study.refusal import Refusal
from nmpcrl.study.robot import RobotEnv

EVERY = "T01 to T60"  # the place of an agent that is trained in all of `TUNE`
THERE, AWAY = "a", "-"  # a letter a layout: whether the robot arrives
RANDOM = 5  # episodes of random actions, with which it begins
BATCH = 128  # transitions of a gradient step
RATE = 1e-3  # of Adam
NOISE = 0.2  # standard deviation of what TD3 adds to an action between -1 and 1
FAR = 10.0  # [m], by which distances are divided


class Checkpoint(NamedTuple):
    """An agent after some interaction."""

    episodes: int  # begun
    steps: int  # of the robot
    policy: Policy  # without noise; it changes as the training goes on


def trained_in(place: str) -> Mapping[str, Centres]:
    """The layouts of a place."""
    return TUNE if place == EVERY else {place: suite.LAYOUTS[place]}


def judged_in(place: str) -> Mapping[str, Centres]:
    """The layouts in which a policy is judged; an agent for all is judged in unseen ones, too."""
    return {**TUNE, **JUDGE} if place == EVERY else trained_in(place)


def curve(checkpoints: Sequence[int], agent: Entry, place: str, episodes: int, seed: int) -> Row:
    """Train an agent, and judge it without noise at each checkpoint.

    The row has the cost of theta_init in each layout of `judged_in`; costs and arrived (a letter a
    layout) at each checkpoint; episodes and steps of the robot.
    """
    robots = [Robot(centres, 1 + len(checkpoints), seed) for centres in judged_in(place).values()]
    initial = [robot.cost(THETA) for robot in robots]
    costs, arrived, layouts = [], [], [*trained_in(place).values()]
    env = RobotEnv(layouts[0])
    for at in trained(agent.name, env, layouts, checkpoints, seed, **agent.settings):
        rollouts = [followed(robot, at.policy) for robot in robots]
        costs.append([one.cost for one in rollouts])
        ends = zip(robots, rollouts, strict=True)
        near = [robot.task.distance(one.states[-1]) <= ARRIVED for robot, one in ends]
        arrived.append("".join(THERE if one else AWAY for one in near))
    return {
        "initial": initial, "costs": costs, "arrived": arrived, "episodes": at.episodes,
        "steps": at.steps,
    }  # fmt: skip


def policy_of(robot: Robot, *, name: str, **settings: float) -> Policy:
    """Train an agent with all episodes of the budget, for the suite."""
    made = trained(name, robot.env(), [robot.centres], [robot.budget], robot.seed, **settings)
    return next(made).policy


_DEFAULTS: Mapping[str, float] = {
    "reward": 0.1,  # factor of minus the cost
    "turn": 1.0,  # share of the turn rates that it may choose from
    "gradient": 1.0,  # gradient steps a step of the robot
    "width": 64,  # neurons in each of the two hidden layers
}
SAC = Entry("SAC", partial(policy_of, name="SAC"), _DEFAULTS)
TD3 = Entry("TD3", partial(policy_of, name="TD3"), {**_DEFAULTS, "reward": 0.01})


def trained(
    name: str, env: Any, layouts: Sequence[Centres], checkpoints: Sequence[int], seed: int,
    **settings: float,
) -> Iterator[Checkpoint]:  # fmt: skip
    """Train SAC or TD3 on `nmpcrl/Robot-v0`, and yield it at each checkpoint.

    A layout is drawn for each episode. Checkpoints are numbers of episodes, rising; settings are
    values for all of `_DEFAULTS`. No other code makes steps in the environment.
    """
    scaled, state = _Scaled(env, layouts, settings), list[Any]()
    with _drawing_from(state):
        model = _model(name, scaled, settings, checkpoints[-1], seed)

    def policy(observation: Vector) -> Vector:
        with _one_thread():
            action, _ = model.predict(seen(observation), deterministic=True)
        return scaled.applied(action)

    for episodes in checkpoints:
        left = (episodes - scaled.episodes) * paper.STEPS
        with _drawing_from(state):
            model.learn(left, reset_num_timesteps=not scaled.episodes)
        yield Checkpoint(scaled.episodes, scaled.steps, policy)


def seen(observation: Vector) -> Vector:
    """The observation of an agent, in numbers of about 1, from one of `nmpcrl/Robot-v0`.

    The target and each centre, as seen from the turned robot [`FAR`]; then the difference between
    the heading and the one at the target [rad], its cosine and its sine.
    """
    place, heading = observation[:2], observation[2]
    points = np.vstack([paper.TARGET[:2], observation[3:].reshape(-1, 2)]) - place
    cos, sin, away = np.cos(heading), np.sin(heading), heading - paper.TARGET[2]
    turned = points @ np.array([[cos, -sin], [sin, cos]]) / FAR
    found: Vector = np.r_[turned.ravel(), away, np.cos(away), np.sin(away)].astype(np.float32)
    return found


class _Scaled(gymnasium.Env[Any, Any]):
    """The robot's task in numbers of about 1, for stable-baselines3; it counts episodes and steps.

    An episode begins with its first step: stable-baselines3 resets once more after the last one.
    """

    def __init__(self, env: Any, layouts: Sequence[Centres], settings: Mapping[str, float]) -> None:
        self.env, self.layouts, self.settings = env, layouts, settings
        self.episodes, self.steps, self.begun, self.layout = 0, 0, False, layouts[0]
        self.observation_space = Box(-np.inf, np.inf, self._first().shape)
        self.action_space = Box(-1.0, 1.0, env.action_space.shape)

    def _first(self) -> Vector:
        return seen(np.r_[paper.START, np.ravel(self.layout)])

    def applied(self, action: ArrayLike) -> Vector:
        """The speed and turn rate of an action between -1 and 1."""
        high, share = self.env.action_space.high, np.array([1.0, self.settings["turn"]])
        applied: Vector = np.asarray(action, float) * high * share
        return applied

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Vector, Any]:
        """Draw a layout."""
        super().reset(seed=seed)
        self.layout = self.layouts[int(self.np_random.integers(len(self.layouts)))]
        self.begun = False
        return self._first(), {}

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, Any]:
        """Move for one period; the first time, begin the episode."""
        if not self.begun:
            self.env.reset(options={"layout": self.layout})
            self.episodes, self.begun = self.episodes + 1, True
        self.steps += 1
        found, reward, end, cut, info = self.env.step(self.applied(action))
        return seen(found), self.settings["reward"] * reward, end, cut, info


def require(name: str = "an agent") -> Any:
    """The module stable-baselines3; a Refusal where it is not installed."""
    try:
        return importlib.import_module("stable_baselines3")
    except ImportError as error:
        needed = f"{name} needs stable-baselines3: `pip install nmpcrl[agents]` brings it"
        raise Refusal(needed) from error


def _model(name: str, env: Any, values: Mapping[str, float], episodes: int, seed: int) -> Any:
    """The agent of stable-baselines3; it learns after each episode and forgets no transition."""
    library = require(name)
    common, size = library.common, env.action_space.shape
    noise = common.noise.NormalActionNoise(np.zeros(size), np.full(size, NOISE))
    model = getattr(library, name)(
        "MlpPolicy",
        env,
        learning_rate=RATE,
        buffer_size=episodes * paper.STEPS,
        learning_starts=RANDOM * paper.STEPS,
        batch_size=BATCH,
        gamma=paper.GAMMA,
        train_freq=(1, "episode"),
        gradient_steps=max(round(values["gradient"] * paper.STEPS), 1),
        action_noise=noise if name == "TD3" else None,
        policy_kwargs={"net_arch": [int(values["width"])] * 2},
        device="cpu",
        seed=seed % 2**32,
    )
    model.set_logger(common.logger.Logger(None, []))  # its own makes a folder for each
    return model


@contextmanager
def _one_thread() -> Iterator[None]:
    """Compute with one thread of torch: more may change last bits."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def _drawing_from(state: list[Any]) -> Iterator[None]:
    """Draw from NumPy's and torch's global generators in `state`, update it, and set both back."""
    import torch

    before = np.random.get_state()  # noqa: NPY002 as stable-baselines3 draws
    with torch.random.fork_rng(devices=[]), _one_thread():
        if state:
            np.random.set_state(state[0])  # noqa: NPY002
            torch.set_rng_state(state[1])
        try:
            yield
        finally:
            state[:] = np.random.get_state(), torch.get_rng_state()  # noqa: NPY002
            np.random.set_state(before)  # noqa: NPY002


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
    return 6 * suite.HELD_OUT + k if place == EVERY else suite.seed_of(place, k)


@dataclass(frozen=True, eq=False)
class Course:
    """The costs of an agent during training, over theta_init's cost."""

    shares: pd.DataFrame  # a row a checkpoint; a column a layout, or in part "one" a seed
    there: pd.DataFrame  # whether the robot arrives, under every seed, as `shares`

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
        first = float(self.shares.index[int(yes.argmax())]) if yes.any() else np.inf
        return first, float(self.shares.index[stays]) if stays < len(yes) else np.inf

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
    return share(one.shares.iloc[-1] <= 1 + TOLERANCE, numbers=one.numbers)


def _less(one: Course, search: pd.Series) -> Answer:
    return cheaper((one.shares.iloc[-1] / search.astype(float)).dropna())


# answer of a course and of the costs of the search; part, and some of its layouts
_ASKED: Mapping[str, tuple[Callable[..., Answer], str, Sequence[str]]] = {
    "matches in 300 episodes": (_matches, "judge", ()),
    "solves in 300 episodes": (lambda one, _: share(
        (one.shares.iloc[-1] <= 1 + TOLERANCE) & one.there.iloc[-1].astype(bool)), "judge", ()),
    "or the best search": (_less, "judge", ()),
    "matches in one layout": (lambda one, _: share(
        one.shares.min() <= 1 + TOLERANCE, "seeds", one.numbers), "one", ()),
    "or the best search in one layout": (lambda one, search: cheaper(  # each seed beside its mean
        (one.shares.iloc[-1] / search.get("A", np.nan)).dropna(), "seeds"), "one", ()),
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
    first, second = (course(known[0], "judge", name).shares.iloc[-1] for name in AGENTS)
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
