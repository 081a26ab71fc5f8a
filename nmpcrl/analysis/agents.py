"""SAC and TD3 of stable-baselines3 on `nmpcrl/Robot-v0`: learners that know nothing of an NMPC.

They are told where the robot is, where its target and where the obstacles' centres are, and after
each step what it cost. They have no model: neither of the robot nor of the cost nor of how large an
obstacle is. `SAC` and `TD3` are entries of the suite.
"""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nmpcrl import Vector
from nmpcrl.analysis.suite import Entry, Policy, Robot, entry
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.storage.refusal import Refusal

AGENTS = ("SAC", "TD3")
REWARD = {"SAC": 0.1, "TD3": 0.01}  # the better of the two for each in one layout to tune on
SETTING: Mapping[str, float] = {  # what can be set of an agent, and is if nothing is said
    "reward": 0.01,  # factor of minus the cost; `REWARD` has that of each
    "turn": 1.0,  # share of the turn rates that it may choose from
    "gradient": 1.0,  # gradient steps a step of the robot
    "width": 64,  # neurons in each of the two hidden layers
}
RANDOM = 5  # episodes of random actions, with which it begins
BATCH = 128  # transitions of a gradient step
RATE = 1e-3  # of Adam
NOISE = 0.2  # standard deviation of what TD3 adds to an action between -1 and 1
FAR = 10.0  # [m], by which distances are divided


class NoAgents(Refusal):
    """stable-baselines3 is not installed; the message says how to get it."""


@dataclass(frozen=True)
class Checkpoint:
    """An agent after some interaction."""

    episodes: int  # begun
    steps: int  # of the robot
    policy: Policy  # without noise; the agent's own, so that it changes as the training goes on


@dataclass(frozen=True)
class Agent:
    """An agent as an entry: it is trained as long as the budget goes, and returns its policy."""

    name: str  # of `AGENTS`
    values: Mapping[str, float]  # of its settings

    def __call__(self, robot: Robot) -> Policy:
        """Its policy without noise.

        Raises:
            NoAgents: stable-baselines3 is not installed.
        """
        made = self.trained(robot.env(), [robot.centres], [robot.budget], robot.seed)
        return next(made).policy

    def trained(
        self, env: Any, layouts: Sequence[Centres], checkpoints: Sequence[int], seed: int
    ) -> Iterator[Checkpoint]:
        """Train it, and yield it after so many episodes each time.

        Args:
            env: `nmpcrl/Robot-v0`, all of whose steps and resets are made here.
            layouts: one is drawn for each episode.
            checkpoints: episodes, rising.
            seed: of all that is drawn.

        Raises:
            NoAgents: stable-baselines3 is not installed.
            OverBudget: as `env.reset`.
        """
        from nmpcrl.learning.network import OneThread

        values = self.values
        scaled, drawing = _scaled(env, layouts, values), _Drawing()
        with drawing.own():
            model = _model(self.name, scaled, values, checkpoints[-1], seed)

        def policy(observation: Vector) -> Vector:
            with OneThread():
                action, _ = model.predict(seen(observation), deterministic=True)
            return _applied(action, values["turn"], env)

        for episodes in checkpoints:
            left = (episodes - scaled.episodes) * paper.STEPS
            with drawing.own():
                model.learn(left, reset_num_timesteps=not scaled.episodes)
            yield Checkpoint(scaled.episodes, scaled.steps, policy)


SAC, TD3 = (
    Entry(
        name,
        lambda robot, name=name, **values: Agent(name, values)(robot),
        {**SETTING, "reward": REWARD[name]},
    )
    for name in AGENTS
)
ENTRIES = {"SAC": SAC, "TD3": TD3}


def agent(name: str) -> Agent:
    """An agent by its name, such as "SAC[reward=0.1]"."""
    one = entry(name, ENTRIES)
    return Agent(one.name, one.settings)


def seen(observation: Vector) -> Vector:
    """What an agent sees of an observation of `nmpcrl/Robot-v0`, in numbers of about 1.

    From the robot, and as it is turned, the target and each centre, in parts of `FAR`; then how far
    the heading is from that at the target, in radians, its cosine and its sine.
    """
    place, heading = observation[:2], observation[2]
    points = np.vstack([paper.TARGET[:2], observation[3:].reshape(-1, 2)]) - place
    cos, sin, away = np.cos(heading), np.sin(heading), heading - paper.TARGET[2]
    turned = points @ np.array([[cos, -sin], [sin, cos]]) / FAR
    found: Vector = np.r_[turned.ravel(), away, np.cos(away), np.sin(away)].astype(np.float32)
    return found


def _applied(scaled: ArrayLike, turn: float, env: Any) -> Vector:
    """The speed and turn rate of an action between -1 and 1."""
    applied: Vector = np.asarray(scaled, float) * env.action_space.high * np.array([1.0, turn])
    return applied


def _scaled(env: Any, layouts: Sequence[Centres], values: Mapping[str, float]) -> Any:
    """The robot's task in numbers of about 1, which counts what is begun.

    An episode begins with its first step: stable-baselines3 resets once more after the last one.
    """
    import gymnasium

    box: Any = gymnasium.spaces.Box

    class Scaled(gymnasium.Env[Vector, Vector]):
        """What an agent acts in."""

        def __init__(self) -> None:
            self.episodes, self.steps, self.begun, self.layout = 0, 0, False, layouts[0]
            self.observation_space = box(-np.inf, np.inf, self._first().shape)
            self.action_space = box(-1.0, 1.0, env.action_space.shape)

        def _first(self) -> Vector:
            return seen(np.r_[paper.START, np.ravel(self.layout)])

        def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Vector, Any]:
            super().reset(seed=seed)
            self.layout = layouts[int(self.np_random.integers(len(layouts)))]
            self.begun = False
            return self._first(), {}

        def step(self, action: Vector) -> tuple[Vector, float, bool, bool, Any]:
            if not self.begun:
                env.reset(options={"layout": self.layout})
                self.episodes, self.begun = self.episodes + 1, True
            self.steps += 1
            found, reward, end, cut, info = env.step(_applied(action, values["turn"], env))
            return seen(found), values["reward"] * reward, end, cut, info

    return Scaled()


def require(name: str = "an agent") -> Any:
    """stable-baselines3.

    Raises:
        NoAgents: it is not installed.
    """
    try:
        return importlib.import_module("stable_baselines3")
    except ImportError as error:
        needed = f"{name} needs stable-baselines3: `pip install nmpcrl[agents]` brings it"
        raise NoAgents(needed) from error


def _model(name: str, env: Any, values: Mapping[str, float], episodes: int, seed: int) -> Any:
    """The agent of stable-baselines3, which learns after each episode and keeps every transition.

    Raises:
        NoAgents: it is not installed.
    """
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


class _Drawing:
    """What an agent draws from NumPy's and torch's global generators, and nobody else does."""

    def __init__(self) -> None:
        self.state: Any = None

    @contextmanager
    def own(self) -> Iterator[None]:
        """Go on drawing; after it both generators are as they were before."""
        import torch

        from nmpcrl.learning.network import OneThread

        before = np.random.get_state(), torch.get_rng_state()  # noqa: NPY002 as SB3 draws
        if self.state:
            _put(*self.state)
        try:
            with OneThread():
                yield
        finally:
            self.state = np.random.get_state(), torch.get_rng_state()  # noqa: NPY002
            _put(*before)


def _put(numpys: Any, torchs: Any) -> None:
    import torch

    np.random.set_state(numpys)  # noqa: NPY002
    torch.set_rng_state(torchs)
