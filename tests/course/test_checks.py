"""The checks of all exercises: solutions pass, and each known mistake is met with its sentence."""

import ast
import sys
from math import comb
from pathlib import Path
from types import SimpleNamespace

import nbformat
import numpy as np
import pytest
from scipy.stats import fisher_exact

from nmpcrl.analysis.two_state import FIRST, PHI, PHI_NEXT, Chain, mspbe
from nmpcrl.course import Unsolved
from nmpcrl.course.checks import solver, what_to_try_first
from nmpcrl.course.exercises import exercises
from nmpcrl.study import paper

BOOK = Path(__file__).resolve().parents[2] / "book"
FEATURES = np.linspace(100.0, 1100.0, 9)


def found():
    for path in sorted(BOOK.glob("*.ipynb")):
        notebook = nbformat.read(path, 4)
        for one in exercises(notebook):
            (imports,) = [c.source for c in notebook.cells if c.id == "exercises-checks"]
            yield pytest.param(one, imports, id=f"{path.stem}-{one.name}")


EXERCISES = list(found())
BY_NAME = {param.values[0].name: param.values for param in EXERCISES}


@pytest.fixture(autouse=True)
def seeded(monkeypatch) -> None:
    """Checks draw the same cases each time."""
    draws = np.random.default_rng
    monkeypatch.setattr(np.random, "default_rng", lambda seed=0: draws(seed))


def given(imports: str) -> dict:
    """What a chapter has computed that an answer or a check needs."""
    names = {"np": np, "comb": comb, "fisher_exact": fisher_exact, "nmpc": paper.nmpc()}
    names["first"] = SimpleNamespace(features=FEATURES)
    exec(imports, names)
    return names


def checked(one, imports: str, answer: str):
    """What the check of an exercise says of an answer, as code."""
    names = given(imports)
    exec(answer, names)
    (check,) = one.parts["check"]
    return eval(check.source, names)


@pytest.mark.parametrize(("one", "imports"), EXERCISES)
def test_a_solution_passes_and_what_is_given_does_not(one, imports):
    (answer,) = one.parts["answer"]
    empty, _, _ = answer.source.partition("### BEGIN SOLUTION")
    for _ in range(3):
        assert checked(one, imports, answer.source).said.startswith("Right")
        with pytest.raises(Unsolved, match=r"\w+ .*[.?]"):
            checked(one, imports, empty)


def mistakes(one, imports: str, monkeypatch) -> dict:
    """The wrong answers that a check knows, by the sentence that it says of each."""
    names = given(imports)
    (source,) = (cell.source for cell in one.parts["check"])
    call = ast.parse(source).body[0].value
    module, heard = sys.modules[names["check"].__name__], {}

    def hears(answer, expected, *rest, mistakes=None, **options):
        for one, other in (mistakes or {}).items():
            heard.update([(one, other)] if isinstance(one, str) else [(other, one)])
        if isinstance(expected, str):
            heard.update({why: letter for letter, why in rest[0].items() if letter != expected})

    with monkeypatch.context() as patched:
        for kind in ("number", "choice", "function", "behaves"):
            patched.setattr(module, kind, hears, raising=False)
        names[call.args[0].id] = None
        eval(source, names)
    return heard


@pytest.mark.parametrize(("one", "imports"), EXERCISES)
def test_a_known_mistake_is_met_with_its_sentence(one, imports, monkeypatch):
    heard = mistakes(one, imports, monkeypatch)
    (source,) = (cell.source for cell in one.parts["check"])
    name = ast.parse(source).body[0].value.args[0].id
    for why, wrong in heard.items():
        with pytest.raises(Unsolved) as refused:
            eval(source, given(imports) | {name: wrong})
        assert str(refused.value) == why


PROPERTIES = {  # of answers that need not be one function: wrong ones, and what is said of them
    solver.residual: {
        lambda gradient, jacobian, g, multipliers: 0.0: "It is 0 where",
        lambda gradient, jacobian, g, multipliers: 1.0: "gives 1 instead of 0",
        lambda gradient, jacobian, g, multipliers: np.abs(
            gradient + jacobian.T @ multipliers
        ).max(): "It is 0 where",
    },
    what_to_try_first.undone: {
        lambda theta, moves, cost: theta + sum(moves): "taken back",
        lambda theta, moves, cost: theta: "are to be kept",
    },
}


@pytest.mark.parametrize("check", PROPERTIES)
def test_a_function_that_lacks_a_property_is_met_with_its_sentence(check):
    for answer, said in PROPERTIES[check].items():
        with pytest.raises(Unsolved, match=said):
            check(answer)


def solved(name: str):
    """The function that an exercise's solution defines."""
    one, imports = BY_NAME[name]
    names = given(imports)
    exec(one.solution, names)
    return names[one.solution.split("(")[0].removeprefix("def ")]


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
    chain, step, alpha = Chain(), solved("ges-gtd2"), 0.1
    theta, w = np.ones(1), np.zeros(1)
    for _ in range(3000):
        delta = chain.delta(theta, FIRST)
        moved = step(theta, w, PHI[FIRST], PHI_NEXT[FIRST], alpha, chain.gamma)
        theta, w = moved, w + ratio * alpha * (delta - PHI[FIRST] @ w) * PHI[FIRST]
    assert abs(theta[0]) < 1e-3


def test_the_direction_of_gradient_td_is_the_slope_of_the_projected_error():
    chain, theta, h = Chain(), 0.7, 1e-5
    delta = np.array([chain.delta(np.array([theta]), FIRST)])
    direction = solved("ges-direction")(PHI[[FIRST]], PHI_NEXT[[FIRST]], delta, chain.gamma)
    slope = (mspbe(chain, theta + h) - mspbe(chain, theta - h)) / (2 * h)
    assert np.allclose(direction, -slope / 2)
