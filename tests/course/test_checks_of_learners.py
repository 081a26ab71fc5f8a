"""The checks of Chapters 2, 3 and 4: they know the library's answer, and the likely mistakes."""

from functools import cache
from pathlib import Path

import nbformat
import numpy as np
import pytest

from nmpcrl.analysis.two_state import FIRST, PHI, PHI_NEXT, Chain, mspbe
from nmpcrl.course import Unsolved
from nmpcrl.course.checks import expected_sarsa, ges, rdes
from nmpcrl.course.exercises import exercises
from nmpcrl.study import paper

CHAPTERS = {"02_expected_sarsa": expected_sarsa, "03_rdes": rdes, "04_ges": ges}
BOOK = Path(__file__).resolve().parents[2] / "book"


@cache
def functions() -> dict[str, tuple]:
    """The checks of functions, each with the code of the empty answer and of the solution."""
    found = {}
    for name, checks in CHAPTERS.items():
        for one in exercises(nbformat.read(BOOK / f"{name}.ipynb", 4)):
            if one.about.kind in ("code", "find the bug"):
                (answer,), (solution,) = one.parts["answer"], one.answers
                asked = solution.split("(")[0].removeprefix("def ")
                found[asked] = (getattr(checks, asked).__wrapped__, answer.source, solution)
    return found


def check(asked: str, code: str):
    """What the check says of a function written as `code`."""
    names = {"np": np}
    exec(code, names)
    checked = functions()[asked][0]
    more = [paper.nmpc()] if asked == "weights_gradient" else []
    return checked(names[asked], *more)


@pytest.mark.parametrize("asked", functions())
def test_a_solution_passes_and_what_is_given_does_not(asked):
    _, given, solution = functions()[asked]
    for _ in range(5):
        assert check(asked, solution).said.startswith("Right")
        with pytest.raises(Unsolved):
            check(asked, given)


WRONG = [  # (function, part of its solution, what a reader writes there, what the check says)
    ("weights_gradient", "return 2 * theta[:8]", "return theta[:8]", "factor of 2"),
    ("weights_gradient", "return 2 * theta[:8] *", "return", "chain rule"),
    ("weights_gradient", "gamma ** np.arange(len(states))", "np.ones(len(states))", "later stages"),
    ("weights_gradient", "weight[-1] * squares[-1]", "squares[-1]", "terminal cost"),
    ("saved", "frozen[-20:]", "training[:20]", "frozen arm with itself"),
    ("saved", "frozen[-20:]", "frozen[:20]", "at the same time"),
    ("saved", "[-20:]", "", "last 20"),
    ("saved", "1 - training", "training", "what was saved is the rest"),
    ("systematic", "nanmean", "mean", "nan"),
    ("systematic", "abs(np.nanmean(error))", "np.nanmean(error)", "absolute value"),
    ("systematic", "np.sqrt(np.nanmean(error**2))", "np.nanstd(error)", "should give 1"),
    ("systematic", "abs(np.nanmean(error))", "np.nanmean(abs(error))", "errors cancel"),
    ("examples", "np.vstack([first, thetas[:-1]])", "thetas", "before that"),
    ("examples", "np.vstack([first, thetas[:-1]])", "np.roll(thetas, 1, 0)", "last theta"),
    ("examples", "np.vstack([first, thetas[:-1]])", "np.roll(thetas, -1, 0)", "wrong direction"),
    ("gtd2_step", "theta + alpha", "theta - alpha", "goes up"),
    ("gtd2_step", "(w @ phi) * (phi - gamma * phi_next)", "((phi - gamma * phi_next) @ w) * phi",
     "beside w"),
    ("gtd2_step", "(phi - gamma * phi_next)", "-gamma * phi_next", "only the correction"),
    ("correction", "(2 * step)", "step", "2 step apart"),
    ("correction", "features(theta - step * w)\n", "features(theta)\n    change = 2 * change\n",
     "forward difference"),
    ("correction", " - w @ features(theta)", "", "leaves of the TD error"),
    ("correction", "(delta - w @ features(theta)) * ", "", "a factor is missing"),
    ("direction", "phi_next.T @ (phi @ w)", "phi.T @ (phi_next @ w)", "transposed"),
    ("direction", " - gamma * phi_next.T @ (phi @ w) / n", "", "that is the direction of ES"),
]  # fmt: skip


@pytest.mark.parametrize(("asked", "right", "wrong", "said"), WRONG)
def test_a_likely_mistake_is_met_with_its_sentence(asked, right, wrong, said):
    solution = functions()[asked][2]
    assert right in solution
    with pytest.raises(Unsolved, match=said):
        check(asked, solution.replace(right, wrong))


def solved(asked: str):
    names = {"np": np}
    exec(functions()[asked][2], names)
    return names[asked]


def test_the_rest_of_the_plan_as_next_value_leaves_a_difference_of_stage_costs():
    nmpc, theta = paper.nmpc(), np.array(paper.THETA_INIT)
    plan = nmpc.solve(nmpc.task.start, theta)
    off = np.append(plan.states[0] - nmpc.task.target, plan.inputs[0])
    first = off**2 @ theta[:5] ** 2 + nmpc.slack_weight * plan.slacks[0].sum()
    cost = nmpc.task.stage_cost(nmpc.task.start, plan.action)
    rest = (plan.value - first) / nmpc.gamma
    delta = cost + nmpc.gamma * rest - plan.value
    assert np.isclose(delta, cost - first)
    assert rdes.tail.__wrapped__("ell - L").said.startswith("Right")


def test_central_differences_are_off_by_half_of_omega_on_an_edge():
    nmpc, theta = paper.nmpc(), np.array(paper.THETA_INIT)
    obstacle, ahead = nmpc.task.obstacles[0], 2.5 / 2 * np.sqrt(1 + theta[8])
    state, h = np.array([obstacle.x - ahead, obstacle.y, 0.0]), 1e-5
    values = [nmpc.solve(state, np.append(theta[:8], theta[8] + s)).value for s in (h, -h)]
    central = (values[0] - values[1]) / (2 * h)
    phi_c = nmpc.solve(state, theta).features[8]
    assert np.isclose(central - phi_c, nmpc.slack_weight / 2, atol=0.1)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 2.0])
def test_gtd2_converges_on_the_chain_for_every_ratio(ratio):
    chain, step, alpha = Chain(), solved("gtd2_step"), 0.1
    theta, w = np.ones(1), np.zeros(1)
    for _ in range(3000):
        delta = chain.delta(theta, FIRST)
        moved = step(theta, w, PHI[FIRST], PHI_NEXT[FIRST], alpha, chain.gamma)
        theta, w = moved, w + ratio * alpha * (delta - PHI[FIRST] @ w) * PHI[FIRST]
    assert abs(theta[0]) < 1e-3


@pytest.mark.parametrize("version", [1, 2])
def test_the_bug_in_the_direction_cannot_be_seen_on_the_chain(version):
    names = {"np": np}
    exec(functions()["direction"][version], names)
    chain, theta, h = Chain(), 0.7, 1e-5
    delta = np.array([chain.delta(np.array([theta]), FIRST)])
    found = names["direction"](PHI[[FIRST]], PHI_NEXT[[FIRST]], delta, chain.gamma)
    slope = (mspbe(chain, theta + h) - mspbe(chain, theta - h)) / (2 * h)
    assert np.allclose(found, -slope / 2)


def test_the_solution_of_the_direction_is_the_slope_of_the_projected_error():
    rng, gamma, h = np.random.default_rng(), 0.97, 1e-5
    phi, phi_next, cost = rng.normal(size=(30, 3)), rng.normal(size=(30, 3)), rng.normal(size=30)

    def error(theta):
        mean = (cost + gamma * phi_next @ theta - phi @ theta) @ phi / 30
        return mean @ np.linalg.solve(phi.T @ phi / 30, mean)

    theta = rng.normal(size=3)
    slope = [(error(theta + e) - error(theta - e)) / (2 * h) for e in h * np.eye(3)]
    delta = cost + gamma * phi_next @ theta - phi @ theta
    found = solved("direction")(phi, phi_next, delta, gamma)
    assert np.allclose(found, -np.array(slope) / 2, rtol=1e-5, atol=1e-6)
