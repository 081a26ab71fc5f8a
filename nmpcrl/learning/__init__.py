"""How the parameters of the NMPC move: a learner is a bootstrap and an update rule.

`train` is Algorithm 1 step by step, `episodes` the same in compiled code, and `evaluate` judges the
result by a rollout without noise.
"""

from nmpcrl.learning.baselines import frozen, random_direction, step_matched
from nmpcrl.learning.batches import batched, lstd_q
from nmpcrl.learning.bootstrap import Bootstrap, Imitation, NextValue, SecondSolve, Transition
from nmpcrl.learning.environment import as_gymnasium
from nmpcrl.learning.episode import Episode, episodes
from nmpcrl.learning.learn import Learned, learn
from nmpcrl.learning.learners import (
    Learner,
    Update,
    UpdateRule,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
    regularized_deep_expected_sarsa,
)
from nmpcrl.learning.network import QNetwork
from nmpcrl.learning.optimisers import Descent, GaussNewton, TrustRegion
from nmpcrl.learning.policy_gradient import policy_gradient
from nmpcrl.learning.remedies import scheduled
from nmpcrl.learning.replay import replayed
from nmpcrl.learning.rollout import Rollout, evaluate
from nmpcrl.learning.training import Diverged, Exploration, Step, count_episodes, count_steps, train
from nmpcrl.learning.updates import (
    auxiliary_step,
    curvature_correction,
    gradient_td_step,
    project,
    semi_gradient_step,
    td_error,
)

__all__ = [
    "Bootstrap", "Descent", "Diverged", "Episode", "Exploration", "GaussNewton", "Imitation",
    "Learned", "Learner", "NextValue", "QNetwork", "Rollout", "SecondSolve", "Step", "Transition",
    "TrustRegion", "Update", "UpdateRule", "Weights", "as_gymnasium", "auxiliary_step", "batched",
    "count_episodes", "count_steps", "curvature_correction", "deep_expected_sarsa", "episodes",
    "evaluate", "expected_sarsa", "frozen", "gradient_expected_sarsa", "gradient_td_step",
    "gradient_tdc", "learn", "lstd_q", "policy_gradient", "project", "q_learning",
    "random_direction", "regularized_deep_expected_sarsa", "replayed", "scheduled",
    "semi_gradient_step", "step_matched", "td_error", "train",
]  # fmt: skip
