"""SAC and TD3 of stable-baselines3 on `nmpcrl/Robot-v0`: learners without an NMPC.

An agent observes the state of the robot, its target and the centres of the obstacles, and after
each step the cost. It knows no model, nor the size of an obstacle.
"""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from nmpcrl import Vector
from nmpcrl.analysis.suite import LAYOUTS, THETA, Entry, Policy, Robot, followed
from nmpcrl.studies.investigation import Row
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED
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
    return TUNE if place == EVERY else {place: LAYOUTS[place]}


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
