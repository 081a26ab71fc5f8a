"""All derivatives in theta of a solution, against central differences and dense algebra."""

from typing import Any

import numpy as np

from nmpcrl.control import Nmpc, Solution

DOUBTFUL = 1e-7, 1e-5  # multipliers in between may belong to an active constraint or to none


def active(solution: Solution) -> tuple[bool, ...] | None:
    """Which rows and bounds hold as equalities; None where a multiplier leaves that in doubt."""
    m, ocp, lam = solution.multipliers, solution.ocp, solution.constraint_duals
    size = max(1.0, np.abs(m.dynamics).max())
    prices = np.outer(ocp.problem.gamma ** np.arange(len(ocp.states)), ocp.slack_weights)
    shares = m.obstacles / prices
    bounds = [np.abs(part) / size for part in (m.inputs, m.states[1:], lam[ocp.hard])]
    found = np.concatenate([np.ravel(part) for part in (shares, 1 - shares, *bounds)])
    least, most = DOUBTFUL
    return None if ((found > least) & (found < most)).any() else tuple(found > most)


def beside(
    nmpc: Nmpc, solution: Solution, step: float = 1e-5, **given: Any
) -> list[tuple[Solution, Solution]] | None:
    """Solutions above and below in each parameter; None where a constraint changes sides.

    Args:
        nmpc: solved `solution`.
        solution: from which each solve begins.
        step: of theta.
        given: the action and the data with which it was solved.
    """
    here, pairs = active(solution), []
    for e in step * np.eye(solution.theta.size):
        above, below = (
            nmpc.solve(solution.state, solution.theta + d, solution, **given) for d in (e, -e)
        )
        pairs.append((above, below))
        if here is None or {active(above), active(below)} != {here}:
            return None
    return pairs


def agrees(
    nmpc: Nmpc, solution: Solution, tolerance: float = 1e-5, step: float = 1e-5, **given: Any
) -> bool:
    """Hold all derivatives to differences and to each other; False at a kink, where none are held.

    Errors are relative to the largest entry, and those of plans to 1 where that is larger.
    """
    pairs = beside(nmpc, solution, step, **given)
    if pairs is None:
        return False

    def near(found: Any, read: Any, size: float = 0.0) -> None:
        slope = np.array([(read(above) - read(below)) / (2 * step) for above, below in pairs])
        size = max(size, np.abs(slope).max())
        np.testing.assert_allclose(found, slope.T, rtol=0, atol=tolerance * size)

    near(solution.features, lambda one: one.value)
    dense = nmpc.value_hessian(solution)
    products = [nmpc.value_hessian_times(solution, e) for e in np.eye(len(dense))]
    for found in (dense, products):
        near(found, lambda one: one.features)
        np.testing.assert_allclose(found, np.transpose(found), atol=tolerance * np.abs(dense).max())
    unit = nmpc.problem.sizes[1]
    near(nmpc.policy_jacobian(solution) / unit[:, None], lambda one: one.action / unit, 1.0)
    return True
