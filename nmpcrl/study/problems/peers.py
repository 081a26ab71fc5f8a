"""`gros_zanon` in csnlp and mpcrl (F. Airaldi), which share no code with this package.

Plan, plant and agent of `gros_zanon` are mpcrl's example of Q-learning: a step of Newton
for each transition, with the outer product of Q's gradient for a Hessian, and no exploration.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from csnlp import Nlp
from csnlp.wrappers import Mpc
from gymnasium.wrappers import TransformReward
from mpcrl import LearnableParameter, LearnableParametersDict, LstdQLearningAgent
from mpcrl.core.errors import MpcSolverError
from mpcrl.optim import NewtonMethod

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Problem
from nmpcrl.learning.environment import StepFunction, as_gymnasium
from nmpcrl.study.problems import gros_zanon as gz

RATE = 0.05  # of mpcrl's example
IPOPT = {"print_level": 0, "sb": "yes", "max_iter": 500}
SOLVERS: dict[str, dict[str, Any]] = {
    "ipopt": {"ipopt": IPOPT},
    "ipopt, 1e-10": {"ipopt": IPOPT | {"tol": 1e-10}},
    "ipopt, exact": {"ipopt": IPOPT | {"tol": 1e-10, "bound_relax_factor": 0.0}},
    "fatrop": {"fatrop": {"max_iter": 500, "print_level": 0}},
}


def run(solver: str, seed: int, steps: int) -> tuple[Vector, Vector]:
    """Costs and disturbances of an episode of `gros_zanon` in which mpcrl's agent learns.

    It has one of `SOLVERS`; a failed solve ends the episode.
    """
    costs, disturbances = [], []

    def plant(state: Vector, action: Vector, rng: np.random.Generator) -> tuple[Any, ...]:
        later, cost, end = gz.plant(state, action, rng)
        costs.append(cost)
        disturbances.append(float(later[0] - (gz.TRUE_A @ state + gz.TRUE_B @ action)[0]))
        return later, cost, end

    with silent(), suppress(MpcSolverError):
        there = world(gz.problem(), plant, gz.START, steps)
        agent(gz.problem(), gros_zanon, solver).train(there, episodes=1, seed=seed)
    return np.array(costs), np.array(disturbances)


def world(problem: Problem, plant: StepFunction, start: Vector, steps: int) -> Any:
    """A plant as mpcrl's agent meets it: a Gymnasium environment whose reward is the cost."""
    env = as_gymnasium(Nmpc(problem), plant=plant, start=start, steps=steps)
    return TransformReward(env, lambda reward: -float(reward))


def agent(
    problem: Problem, plan: Callable[[Mpc, dict[str, Any]], Any], solver: str
) -> LstdQLearningAgent:
    """Q-learning after each transition, with one of `SOLVERS`.

    `plan` adds variables and constraints to an empty `Mpc`, and returns its objective; its second
    argument has the parameters of `problem` by name.
    """
    starts = {name: np.asarray(one, float) for name, one in problem.split(problem.theta).items()}
    shapes = {name: one.shape if one.ndim == 2 else (one.size, 1) for name, one in starts.items()}
    mpc = Mpc(Nlp("SX"), problem.horizon)
    theta = {name: mpc.parameter(name, shape) for name, shape in shapes.items()}
    mpc.minimize(plan(mpc, theta))
    common = {"expand": True, "print_time": False, "bound_consistency": True, "calc_lam_p": False}
    mpc.init_solver(common | SOLVERS[solver], solver=next(iter(SOLVERS[solver])), type="nlp")
    learnable = [LearnableParameter(name, one.shape, one) for name, one in starts.items()]
    return LstdQLearningAgent(
        mpc=mpc,
        learnable_parameters=LearnableParametersDict(learnable),
        discount_factor=problem.gamma,
        update_strategy=1,
        optimizer=NewtonMethod(RATE),
        hessian_type="approx",
        remove_bounds_on_initial_action=True,
    )


def gros_zanon(plan: Mpc, th: dict[str, Any]) -> Any:
    """The plan of `gros_zanon` by multiple shooting, for `agent`."""
    x, _ = plan.state("x", 2, bound_initial=False)
    u, _ = plan.action("u", 1, lb=-1, ub=1)
    slack, _, _ = plan.variable("s", (2, gz.HORIZON), lb=0)
    plan.set_affine_dynamics(th["A"], th["B"], c=th["b"])
    plan.constraint("lower", gz.LOWER[:, None] + th["x_lower"] - slack, "<=", x[:, 1:])
    plan.constraint("upper", x[:, 1:], "<=", gz.UPPER[:, None] + th["x_upper"] + slack)
    objective = th["V0"] + x[:, -1].T @ gz.TERMINAL @ x[:, -1]
    for i in range(gz.HORIZON):
        z, v, s = x[:, i], u[:, i], slack[:, i]
        stage = 0.5 * (z.T @ z + 0.5 * v**2 + gz.PENALTY * (s[0] + s[1]))
        objective += gz.GAMMA**i * stage + th["f"][:2].T @ z + th["f"][2] * v
    return objective


@contextmanager
def silent() -> Iterator[None]:
    """Hide CasADi's warnings on numpy functions, which mpcrl calls on its arrays."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        yield
