"""The baseline: Q-learning by mpcrl, the library of this field, on the paper's problem.

`LstdQLearningAgent` of mpcrl (F. Airaldi) learns as `semi_gradient` does, from two solves and a
gradient a step. It is set up as its examples are: csnlp writes the problem in SX, each solve starts
from the last one's plan, Ipopt is silent and has the options of our own. Other starts of Ipopt's
barrier and the linear solver spral were no faster; fatrop, which cannot see the stages in csnlp's
order of the variables, fails on every other step.
"""

import time
import warnings
from typing import Any

import gymnasium
import numpy as np
from csnlp import Nlp
from csnlp.wrappers import Mpc
from mpcrl import (
    LearnableParameter,
    LearnableParametersDict,
    LstdQLearningAgent,
    exploration,
    optim,
    schedulers,
)

from nmpcrl import Vector
from nmpcrl.control import Ipopt, Nmpc
from nmpcrl.control.task import Theta, overlap, stage_cost, terminal_cost
from nmpcrl.study import paper


def time_mpcrl(steps: int = 60) -> list[float]:
    """Seconds of each of mpcrl's learning steps: V, Q, its gradient, the update and the plant.

    Args:
        steps: how many, of one episode with the paper's noise.

    Raises:
        MpcSolverError: a solve failed, and nothing was learned from its step.
    """
    nmpc = paper.nmpc()
    world = World(nmpc, steps)
    with warnings.catch_warnings():  # casadi's on numpy functions, which mpcrl calls on its arrays
        warnings.simplefilter("ignore", FutureWarning)
        agent(nmpc).train(world, episodes=1, seed=0)
    return np.diff(world.calls).tolist()


def agent(nmpc: Nmpc) -> LstdQLearningAgent:
    """The agent: theta moves after every step, the noise is added to u_0 and clipped."""
    theta = LearnableParameter("theta", len(paper.THETA_INIT), paper.THETA_INIT)
    return LstdQLearningAgent(
        mpc=_mpc(nmpc),
        update_strategy=1,
        discount_factor=nmpc.gamma,
        optimizer=optim.GradientDescent(paper.ALPHA),  # of first order: no Hessian is computed
        learnable_parameters=LearnableParametersDict([theta]),
        exploration=exploration.GreedyExploration(
            strength=schedulers.ExponentialScheduler(paper.NOISE, paper.DECAY_RATE),
            hook="on_timestep_end",  # departure C
            mode="additive",
        ),
        remove_bounds_on_initial_action=True,  # of Q, as `transcribe` does
    )


def _mpc(nmpc: Nmpc) -> Mpc:
    """Eq. (2) in csnlp, by multiple shooting."""
    plant, task, horizon = nmpc.plant, nmpc.task, nmpc.horizon
    mpc = Mpc(Nlp("SX"), horizon)
    theta = mpc.parameter("theta", (len(paper.THETA_INIT), 1))
    weights = Theta.split(theta, plant.n, plant.m)
    box = {"lb": task.lower[:, None], "ub": task.upper[:, None]}
    x, _ = mpc.state("x", plant.n, **box, bound_initial=False)  # departure M
    u, _ = mpc.action("u", plant.m, lb=plant.lower[:, None], ub=plant.upper[:, None])
    mpc.set_nonlinear_dynamics(plant.transition)  # departure O

    discount = nmpc.gamma ** np.arange(horizon + 1)
    objective = discount[-1] * terminal_cost(x[:, -1], weights, task.target)
    for i in range(horizon):
        objective += discount[i] * stage_cost(x[:, i], u[:, i], weights, task.target)
    for number, disc in enumerate(zip(*task.discs, strict=True)):
        tightened = overlap(x[0, :], x[1, :], *disc) + weights.c
        _, _, sigma = mpc.constraint(f"obstacle_{number}", tightened, "<=", 0, soft=True)
        objective += nmpc.slack_weight * (sigma @ discount)
    mpc.minimize(objective)
    mpc.init_solver(
        {
            "expand": True,
            "print_time": False,
            "bound_consistency": True,
            "calc_lam_p": False,
            "ipopt": Ipopt().options,
        },
        solver="ipopt",
    )
    return mpc


class World(gymnasium.Env):
    """The plant and the RL stage cost as a gymnasium environment, which notes when it is called.

    mpcrl calls it once a learning step, so that a step lasts from one call to the next.
    """

    def __init__(self, nmpc: Nmpc, steps: int) -> None:
        self.action_space = gymnasium.spaces.Box(nmpc.plant.lower, nmpc.plant.upper, dtype=float)
        self.calls: list[float] = []  # times of `step` [s], one more than there are steps
        self._plant, self._task, self._steps = nmpc.plant, nmpc.task, steps

    def reset(self, **_: Any) -> tuple[Vector, dict[str, Any]]:
        """Back to the start."""
        self._state = self._task.start
        return self._state, {}

    def step(self, action: Any) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Next state, cost, whether the episode is over, whether it was cut short, nothing."""
        self.calls.append(time.perf_counter())
        action = np.asarray(action).ravel()
        cost = self._task.stage_cost(self._state, action)
        self._state = self._plant.step(self._state, action)
        return self._state, cost, False, len(self.calls) > self._steps, {}
