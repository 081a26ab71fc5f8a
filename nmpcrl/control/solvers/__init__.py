"""Ways to solve Eq. (2): CasADi's solvers, and one that is generated for a plant."""

from nmpcrl.control.solvers.nlpsol import Fatrop, Ipopt
from nmpcrl.control.solvers.realtime import real_time
from nmpcrl.control.solvers.riccati import Riccati
from nmpcrl.control.solvers.solver import (
    LARGEST_TOLERANCE,
    LEAST_TOLERANCE,
    TOLERANCE,
    Asked,
    Prepared,
    Solver,
)

__all__ = [
    "LARGEST_TOLERANCE", "LEAST_TOLERANCE", "SOLVERS", "TOLERANCE", "Asked", "Fatrop", "Ipopt",
    "Prepared", "Riccati", "Solver", "real_time", "solver_of",
]  # fmt: skip

SOLVERS: dict[str, type[Solver]] = {kind.name: kind for kind in (Riccati, Fatrop, Ipopt)}


def solver_of(solver: Solver | str) -> Solver:
    """A solver as it is, or the one of a name in `SOLVERS` with its defaults.

    Raises:
        ValueError: there is no solver of that name.
    """
    if isinstance(solver, Solver):
        return solver
    if solver not in SOLVERS:
        raise ValueError(f"solver = {solver!r} must be one of {', '.join(SOLVERS)}")
    return SOLVERS[solver]()
