"""The controller: plant, task, problem, NMPC and solvers. Nothing else imports CasADi."""

from nmpcrl.control.batch import Batch
from nmpcrl.control.nmpc import Nmpc
from nmpcrl.control.plant import Plant, differential_drive, rk4, unicycle
from nmpcrl.control.policy import Policy
from nmpcrl.control.problem import Hard, Parameter, Problem, Series, Soft
from nmpcrl.control.sensitivity import Gradient
from nmpcrl.control.solution import DerivativeError, Solution, SolverError, Status
from nmpcrl.control.solvers import Fatrop, Ipopt, Riccati, real_time
from nmpcrl.control.task import Obstacle, Task

__all__ = [
    "Batch", "DerivativeError", "Fatrop", "Gradient", "Hard", "Ipopt", "Nmpc", "Obstacle",
    "Parameter", "Plant", "Policy", "Problem", "Riccati", "Series", "Soft", "Solution",
    "SolverError", "Status", "Task", "differential_drive", "real_time", "rk4", "unicycle",
]  # fmt: skip
