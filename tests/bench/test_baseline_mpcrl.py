"""mpcrl solves our problem and learns as we do; how fast, no test says."""

import numpy as np
import pytest

from nmpcrl.study import paper

pytest.importorskip("mpcrl")

from nmpcrl.bench import baseline_mpcrl

# csnlp, which mpcrl rests on, calls NumPy's functions on CasADi's values.
pytestmark = pytest.mark.filterwarnings(
    r"ignore:\s*casadi. a numpy function was called on a casadi value:FutureWarning"
)

THETA = np.array(paper.THETA_INIT)
INSIDE = np.array([-0.5, 1.5, 0.0])  # the rim of an obstacle, where the slacks are at work

each_state = pytest.mark.parametrize(
    "state", [np.array(paper.START), INSIDE], ids=["at the start", "inside an obstacle"]
)


@pytest.fixture(scope="module")
def nmpc():
    return paper.nmpc()


@pytest.fixture
def agent(nmpc):
    return baseline_mpcrl.agent(nmpc)


class Watched(baseline_mpcrl.World):
    """A world that keeps its last transition."""

    def step(self, action):
        state = self._state
        after, cost, *flags = super().step(action)
        self.last = (state, np.asarray(action).ravel(), cost, after)
        return after, cost, *flags


def plan(solution):
    """Where to start: around an obstacle there are several optima."""
    return {"x": solution.states.T, "u": solution.inputs.T}


@each_state
def test_its_state_value_and_policy_are_ours(agent, nmpc, state):
    ours = nmpc.solve(state, THETA)
    action, solution = agent.state_value(state, deterministic=True, vals0=plan(ours))
    assert solution.success
    assert solution.f == pytest.approx(ours.value, rel=1e-6)
    assert action.full().ravel() == pytest.approx(ours.action, abs=1e-4)


@each_state
@pytest.mark.parametrize("action", [(0.3, -0.2), (0.6, np.pi / 2)], ids=["within", "at the bounds"])
def test_its_action_value_is_ours_with_the_first_input_fixed(agent, nmpc, state, action):
    ours = nmpc.solve(state, THETA, action=np.array(action))
    solution = agent.action_value(state, np.array(action), vals0=plan(ours))
    assert solution.success
    assert solution.f == pytest.approx(ours.value, rel=1e-6)


def test_at_the_start_it_finds_our_value_unaided(agent, nmpc):
    _, solution = agent.state_value(nmpc.task.start, deterministic=True)
    assert solution.f == pytest.approx(nmpc.solve(nmpc.task.start, THETA).value, rel=1e-6)


def test_a_step_moves_theta_by_alpha_delta_phi(agent, nmpc):
    world = Watched(nmpc, steps=0)
    agent.train(world, episodes=1, seed=0)
    state, action, cost, after = world.last
    q = nmpc.solve(state, THETA, action=action)
    delta = cost + nmpc.gamma * nmpc.solve(after, THETA).value - q.value
    moved = agent.learnable_parameters.value - THETA
    assert moved == pytest.approx(paper.ALPHA * delta * q.features, rel=1e-3, abs=1e-9)


def test_every_step_has_a_time():
    times = baseline_mpcrl.time_mpcrl(steps=3)
    assert len(times) == 3
    assert min(times) > 0
