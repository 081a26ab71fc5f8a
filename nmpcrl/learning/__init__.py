"""How the parameters of the NMPC move: a learner is a bootstrap and an update rule."""

from nmpcrl.learning.bootstrap import Bootstrap, Imitation, SecondSolve, Successor, Transition
from nmpcrl.learning.learners import (
    Learner,
    Update,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    regularized_deep_expected_sarsa,
)
from nmpcrl.learning.network import QNetwork
from nmpcrl.learning.updates import (
    auxiliary_step,
    gradient_td_step,
    semi_gradient_step,
    td_error,
)

__all__ = [
    "Bootstrap",
    "Imitation",
    "Learner",
    "QNetwork",
    "SecondSolve",
    "Successor",
    "Transition",
    "Update",
    "Weights",
    "auxiliary_step",
    "deep_expected_sarsa",
    "expected_sarsa",
    "frozen",
    "gradient_expected_sarsa",
    "gradient_td_step",
    "regularized_deep_expected_sarsa",
    "semi_gradient_step",
    "td_error",
]
