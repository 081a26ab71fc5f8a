"""Value, multipliers and all derivatives: riccati, Ipopt and finite differences on one problem."""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
import pytest
from differences import active, agrees
from small_problems import drawn, limited, pendulum, tank

from nmpcrl.control import Ipopt, Nmpc, Problem, Riccati
from nmpcrl.study import paper


class Case(NamedTuple):
    """A controller, and what it is asked."""

    make: Callable[[Any], Nmpc]  # of a solver
    center: Any  # of the drawn states
    spread: Any
    data: Callable[[np.random.Generator], dict[str, Any] | None] = lambda rng: None
    theta: float = 0.1  # theta is drawn so far from its start, in parts of itself and of 1
    count: int = 6
    compared: int = 6  # of twice so many, at least: the others are kinks, or other minima
    tolerance: float = 2e-5
    compiled: bool = False


def forecast(rng: np.random.Generator) -> dict[str, Any]:
    return {"wind": rng.normal(scale=0.05, size=7), "target": rng.normal(scale=0.5, size=2)}


def of(problem: Problem) -> Callable[[Any], Nmpc]:
    return lambda solver: Nmpc(problem, solver=solver)


CASES = {
    "the robot": Case(
        lambda solver: paper.nmpc(solver=solver),
        [3, 3, 0], [6, 6, 3], theta=0.3, count=12, compared=10, tolerance=1e-4, compiled=True,
    ),
    "a soft box": Case(
        lambda solver: paper.nmpc(solver=solver, box="soft", horizon=3),
        [9.1, 6, 0], [0.2, 1, 1], theta=0.3, count=4, compared=4,
    ),
    "rows and data": Case(of(pendulum()), [0, 0], [1.2, 1.2], forecast),
    "hard rows": Case(of(limited()), [0, 0], [0.5, 0.5], forecast),
    "micropascals": Case(of(tank(1e-6)), [5e-7, 1e-6], [5e-7, 5e-7], count=3, compared=3),
    **{f"problem {k}": Case(of(drawn(k)), 0.0, 1.0, compared=2, count=3) for k in range(15)},
    "megapascals": Case(of(tank(1e6)), [5e5, 1e6], [5e5, 5e5], count=6, compared=4),
}  # fmt: skip


def asked(case: Case, nmpc: Nmpc) -> Iterator[tuple[Any, ...]]:
    """States, thetas, and what else a solve is given: u_0 free and fixed in turn."""
    rng, start = np.random.default_rng(1), nmpc.problem.theta
    start = np.array(paper.THETA_INIT) if nmpc.task else start
    low, high = np.maximum(nmpc.lower, -1e9), np.minimum(nmpc.upper, 1e9)
    for _ in range(case.count):
        state = case.center + np.multiply(case.spread, rng.uniform(-1, 1, nmpc.n))
        size = np.abs(start) if nmpc.task else 1.0
        theta = start + case.theta * size * rng.uniform(-1, 1, start.size)
        data = case.data(rng)
        for action in (None, rng.uniform(low, high) * 0.6):
            yield state, theta, {"action": action, "data": data}


@pytest.mark.parametrize("name", CASES)
def test_values_and_all_derivatives_are_those_of_ipopt_and_of_differences(name, request):
    case = CASES[name]
    if not case.compiled:
        request.getfixturevalue("interpreted")
    riccati, ipopt, compared = case.make(Riccati(1e-11)), case.make(Ipopt(1e-10)), 0
    for state, theta, given in asked(case, riccati):
        ours = riccati.solve(state, theta, **given)
        assert riccati.kkt_residual(ours, relative=True) < 1e-6
        theirs = ipopt.solve(state, theta, ours, **given)
        unit_x, unit_u = riccati.problem.sizes
        if np.abs((theirs.inputs - ours.inputs) / unit_u).max() > 1e-2:
            continue  # another minimum
        assert ours.value == pytest.approx(theirs.value, rel=1e-6, abs=1e-6)
        if active(ours) is None or not agrees(riccati, ours, case.tolerance, **given):
            continue
        units = {"dynamics": unit_x, "initial": unit_x, "states": unit_x, "inputs": unit_u,
                 "action": unit_u}  # fmt: skip
        one, other = (asdict(found.multipliers) for found in (ours, theirs))
        size = max(1.0, np.abs(one["dynamics"] * unit_x).max())
        for kind, found in one.items():
            if not found.size:
                continue
            apart = (found - other[kind]) * units.get(kind, 1.0) / size
            assert np.abs(apart).max() < 1e-4, kind
        np.testing.assert_allclose(ours.features, theirs.features, atol=1e-5 * size)
        np.testing.assert_allclose(ours.slacks, theirs.slacks, atol=1e-4)
        compared += 1
    assert compared >= case.compared
