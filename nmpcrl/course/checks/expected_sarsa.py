"""The exercises of Chapter 2."""

from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.course.checks.precision import to_digits
from nmpcrl.study import paper


def multiplier(answer: Any) -> Outcome:
    """Of min x^2 subject to theta - x <= 0: where the Lagrangian is stationary."""
    theta = 3
    x = theta
    return number(
        answer,
        2 * x,
        tolerance=1e-3,
        mistakes={
            x: "That is the minimiser: set the Lagrangian's derivative by x to zero there.",
            x**2: "That is the optimal cost; the multiplier is the rate at which it rises.",
            -2 * x: "The multiplier of an inequality is not negative: look at the sign of x.",
            0.0: "The constraint is active: without it x would be 0.",
        },
    )


def alpha(answer: Any, features: Vector) -> Outcome:
    """The step size with which the value moves by the TD error, to first order."""
    squared = float(features @ features)
    return number(
        answer,
        1 / squared,
        tolerance=to_digits(1 / squared, 3, least=0.01),
        mistakes={
            squared**-0.5: "The step has the length alpha delta times the norm of phi, and the "
            "value moves by that length times the norm once more.",
            paper.ALPHA: "That is the paper's step size, which closes a part of the TD error.",
            squared: "It is the other way round: the larger phi, the smaller the step.",
        },
    )


def kink(answer: Any) -> Outcome:
    """Why central differences are off by half of omega in some states, and exact in others."""
    return choice(
        answer,
        "c",
        {
            "a": "The solver's tolerance would show in every state, and not as the same number.",
            "b": "A missing factor would be missing in the other states, too.",
            "c": "one slope is the library's, the other is larger by omega, and their mean is "
            "larger by half of it.",
            "d": "With curvature the error would shrink with the step; here it does not.",
        },
    )


def weights_gradient(answer: Any, nmpc: Nmpc) -> Outcome:
    """All of phi but phi_c, for plans of the NMPC; right is what CasADi differentiated."""
    solved: dict[bytes, Vector] = {}

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        state = rng.uniform([0.0, 0.5, 0.0], [6.0, 3.0, 1.5])
        theta = np.array(paper.THETA_INIT) * rng.uniform(0.7, 1.4, len(paper.THETA_INIT))
        plan = nmpc.solve(state, theta)
        solved[theta.tobytes()] = plan.features[:-1]
        arrays = {"theta": theta, "states": plan.states, "inputs": plan.inputs}
        return arrays | {"target": nmpc.task.target, "gamma": nmpc.gamma}

    def right(theta: Vector, **_: Any) -> Vector:
        return solved[theta.tobytes()]

    def undiscounted(gamma: float, **case: Any) -> Vector:
        return _by_hand(gamma=1.0, **case)

    def end_undiscounted(gamma: float, states: Vector, **case: Any) -> Vector:
        scale = np.append(np.ones(5), np.full(3, gamma ** (1 - len(states))))
        return scale * _by_hand(gamma=gamma, states=states, **case)

    return function(
        answer,
        right,
        draw,
        tolerance=1e-6,
        mistakes={
            "The weights are squares of theta: the derivative of a square has a factor of 2.": (
                lambda **case: _by_hand(**case) / 2
            ),
            "That is the derivative in the squares of theta; by the chain rule, each component "
            "is still to be multiplied by 2 theta.": (
                lambda theta, **case: _by_hand(theta=np.full(9, 0.5), **case)
            ),
            "The costs of later stages are discounted.": undiscounted,
            "The terminal cost is discounted, too, by gamma to the power of N.": end_undiscounted,
        },
    )


def _by_hand(theta: Vector, states: Vector, inputs: Vector, target: Vector, gamma: float) -> Vector:
    """The derivative of Eq. (2a) in the first eight components of theta."""
    discount, squares = gamma ** np.arange(len(states)), (states - target) ** 2
    stages = discount[:-1] @ np.hstack([squares[:-1], inputs**2])
    result: Vector = 2 * theta[:8] * np.append(stages, discount[-1] * squares[-1])
    return result


def saved(answer: Any) -> Outcome:
    """The late training cost of a run beside that of its baseline at the same time."""
    late = 20

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        before = rng.integers(40, 100)
        noise = np.r_[np.linspace(1, 0.3, before), np.zeros(late)]
        frozen = rng.uniform(3000, 5000) * (1 + noise) + rng.normal(0, 10, before + late)
        learned = np.r_[np.linspace(1, end := rng.uniform(0.7, 1.1), before), np.full(late, end)]
        ends = [-late - 1, -late, -1]  # they show who counts one too many or one too few,
        amid = -2 - rng.choice(late - 2, 2, replace=False)  # and these keep mean and median
        learned[ends] += (size := rng.uniform(0.3, 0.5, 3))
        learned[amid] -= size[1:]
        return {"training": frozen * learned, "frozen": frozen}

    return function(
        answer,
        lambda training, frozen: 1 - training[-late:].mean() / frozen[-late:].mean(),
        draw,
        tolerance=2e-3,  # the mean of the ratios is as good as the ratio of the means
        mistakes={
            "A baseline with itself still saves something: compare the last episodes of both "
            "runs, in which the noise is the same.": (
                lambda training, frozen: 1 - training[-late:].mean() / training[:late].mean()
            ),
            "The first episodes of the baseline have more noise than the last ones of the run: "
            "compare both at the same time.": (
                lambda training, frozen: 1 - training[-late:].mean() / frozen[:late].mean()
            ),
            "Over all episodes most of the cost is from before anything was learned: take the "
            f"last {late}.": lambda training, frozen: 1 - training.mean() / frozen.mean(),
            "The last episode is left out: a slice ends before the index behind its colon.": (
                lambda training, frozen: 1 - training[-late:-1].mean() / frozen[-late:-1].mean()
            ),
            f"Those are {late + 1} episodes.": (
                lambda training, frozen: (
                    1 - training[-late - 1 :].mean() / frozen[-late - 1 :].mean()
                )
            ),
            "That is the share which is left; what was saved is the rest.": (
                lambda training, frozen: training[-late:].mean() / frozen[-late:].mean()
            ),
        },
    )
