"""SAC and TD3 of stable-baselines3 on `nmpcrl/Robot-v0`: learners without an NMPC.

An agent observes the state of the robot, its target and the centres of the obstacles, and after
each step the cost. It has no model: neither of the robot nor of the cost, nor the size of an
obstacle. `pip install nmpcrl[agents]` brings stable-baselines3.
"""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nmpcrl import Vector
from nmpcrl.analysis.suite import LAYOUTS, THETA, Entry, Policy, Robot, followed
from nmpcrl.claims.investigation import Row
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


class NoAgents(Refusal):
    """stable-baselines3 is not installed; the message says how to get it."""


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

    Returns:
        initial, the cost of theta_init in each layout of `judged_in`; costs and arrived (a letter a
        layout) at each checkpoint; episodes and steps of the robot.

    Raises:
        NoAgents: stable-baselines3 is not installed.
    """
    robots = [Robot(centres, 1 + len(checkpoints), seed) for centres in judged_in(place).values()]
    initial = [robot.cost(THETA) for robot in robots]
    costs, arrived, layouts = [], [], [*trained_in(place).values()]
    at = Checkpoint(0, 0, np.zeros_like)
    env = RobotEnv(layouts[0])
    for at in trained(agent.name, env, layouts, checkpoints, seed, **agent.settings):
        judged = [_judged(robot, at.policy) for robot in robots]
        costs.append([cost for cost, _ in judged])
        arrived.append("".join(THERE if there else AWAY for _, there in judged))
    return {
        "initial": initial, "costs": costs, "arrived": arrived, "episodes": at.episodes,
        "steps": at.steps,
    }  # fmt: skip


def _judged(robot: Robot, policy: Policy) -> tuple[float, bool]:
    """The cost of a rollout, and whether it ends at the target."""
    rollout = followed(robot, policy)
    return rollout.cost, bool(robot.task.distance(rollout.states[-1]) <= ARRIVED)


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
    """Train an agent, and yield it at each checkpoint.

    Args:
        name: "SAC" or "TD3".
        env: `nmpcrl/Robot-v0`, all of whose steps and resets are made here.
        layouts: one is drawn for each episode.
        checkpoints: episodes, rising.
        seed: of all that is drawn.
        settings: those of `SAC` and `TD3`.

    Raises:
        NoAgents: stable-baselines3 is not installed.
        OverBudget: as `env.reset`.
    """
    from nmpcrl.learning.network import OneThread

    scaled, drawing = _scaled(env, layouts, settings), _Drawing()
    with drawing.own():
        model = _model(name, scaled, settings, checkpoints[-1], seed)

    def policy(observation: Vector) -> Vector:
        with OneThread():
            action, _ = model.predict(seen(observation), deterministic=True)
        return _applied(action, settings["turn"], env)

    for episodes in checkpoints:
        left = (episodes - scaled.episodes) * paper.STEPS
        with drawing.own():
            model.learn(left, reset_num_timesteps=not scaled.episodes)
        yield Checkpoint(scaled.episodes, scaled.steps, policy)


def seen(observation: Vector) -> Vector:
    """The observation of an agent, of an observation of `nmpcrl/Robot-v0`, in numbers of about 1.

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
    """The robot's task in numbers of about 1, which counts episodes and steps.

    An episode begins with its first step: stable-baselines3 resets once more after the last one.
    """
    import gymnasium

    box: Any = gymnasium.spaces.Box

    class Scaled(gymnasium.Env[Vector, Vector]):
        """The environment that stable-baselines3 sees."""

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
    """The agent of stable-baselines3; it learns after each episode and forgets no transition.

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
    """The state of NumPy's and torch's global generators while an agent draws from them."""

    def __init__(self) -> None:
        self.state: Any = None

    @contextmanager
    def own(self) -> Iterator[None]:
        """Set both generators to the agent's state, and afterwards back."""
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
