"""V and Q, the values that make up a controller, and the arguments that are refused."""

import numpy as np
import pytest

from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
START = np.array(paper.START)


def test_the_action_value_of_the_policy_is_the_value_and_no_action_is_better(robot, draw):
    """Q >= V, where V is the best plan known: a fixed action may lead to a better local minimum."""
    rng, led = np.random.default_rng(31), 0
    lower, upper = robot.plant.lower, robot.plant.upper
    for state, theta in draw(25, seed=30):
        v = robot.solve(state, theta)
        q = robot.solve(state, theta, v, v.action)
        assert q.value == pytest.approx(v.value, rel=1e-6, abs=1e-6)
        np.testing.assert_allclose(q.features, v.features, atol=1e-5 * np.abs(v.features).max())
        # What pulls at a fixed action is what its bound held back, and nothing where it was free.
        np.testing.assert_allclose(q.multipliers.action, v.multipliers.inputs[0], atol=1e-2)
        corner = np.where(rng.random(2) < 0.5, lower, upper)
        for action in (rng.uniform(lower, upper), corner):
            q = robot.solve(state, theta, action=action)
            np.testing.assert_allclose(q.action, action, atol=1e-8)
            assert (np.abs(q.inputs[1:]) <= upper).all()
            if q.value < v.value:
                v = robot.solve(state, theta, q)
                led += 1
            assert q.value >= v.value - 1e-7 * abs(v.value)
        for one in (v, q):
            assert robot.kkt_residual(one) < 1e-4
            assert robot.kkt_residual(one, relative=True) <= robot.kkt_residual(one)
    assert led <= 3


def test_a_solution_carries_what_learning_reads_and_multipliers_with_their_signs(robot, draw):
    price = 100 * 0.97 ** np.arange(11)[:, None] * np.ones(4)
    for state, theta in draw(10, seed=33):
        solution = robot.solve(state, theta)
        m, shapes = solution.multipliers, [(11, 3), (10, 2), (11, 4), (10, 3), (0,), (9,)]
        parts = (solution.states, solution.inputs, solution.slacks, m.dynamics, m.action)
        assert [part.shape for part in (*parts, solution.features)] == shapes
        assert isinstance(solution.value, float)
        assert solution.iterations > 0
        assert solution.seconds > 0
        assert solution.status == "solved" or solution.restarts
        np.testing.assert_array_equal(solution.action, solution.inputs[0])
        np.testing.assert_array_equal(solution.state, state)
        np.testing.assert_array_equal(solution.theta, theta)
        assert (m.obstacles >= -1e-6).all()
        assert (m.obstacles <= price + 1e-6).all()
        assert (m.slacks <= 1e-6).all()
        np.testing.assert_allclose(m.obstacles - m.slacks, price, atol=1e-4)
        pressed = np.abs(m.inputs) > 1e-2
        bounds = np.sign(m.inputs) * robot.plant.upper
        np.testing.assert_allclose(solution.inputs[pressed], bounds[pressed], atol=1e-5)


def test_the_value_at_the_start_is_about_a_thousand_whatever_the_signs_of_weights(robot):
    """DESIGN's reference numbers, from independent code: 1037, and a slope of norm 1934."""
    signs = np.array([-1, 1, -1, 1, -1, 1, -1, 1, 1])
    one, other = robot.solve(START.tolist(), THETA.tolist()), robot.solve(START, THETA * signs)
    assert one.value == pytest.approx(1037, abs=1)
    assert np.linalg.norm(one.features) == pytest.approx(1934, abs=1)
    assert other.value == pytest.approx(one.value, rel=1e-9)
    np.testing.assert_allclose(other.features, one.features * signs, rtol=1e-5, atol=1e-5)


def put(name, index, number):
    """The arguments of a solve, one of whose numbers is another."""
    arguments = {"state": START.copy(), "theta": THETA.copy(), "action": np.zeros(2)}
    arguments[name][index] = number
    return arguments


ALLOWED = r"must lie between \[-0.6\s+-1.5708\] and \[0.6\s+1.5708\]"
ABSURD = {"nan": np.nan, "inf": np.inf, "-inf": -np.inf, r"(e\+07|10000000)": 1e7}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *((put(name, i, number), rf"^{name} .*{shown}.* must hold finite numbers of size at most")
          for name, i in (("state", 0), ("state", -1), ("theta", 0), ("theta", -1), ("action", 1))
          for shown, number in ABSURD.items()),
        *((put("action", i, number), f"^action .* {ALLOWED}")
          for i, number in ((0, 0.61), (0, -0.61), (1, 1.58), (1, -1.58))),
        ({"state": START[:2]}, r"state has shape \(2,\); it must be \(3,\)"),
        ({"theta": THETA[:8]}, r"theta has shape \(8,\); it must be \(9,\)"),
        ({"state": ["x", "y", "z"]}, r"state = \['x', 'y', 'z'\] must be a number or an arr"),
        ({"theta": [[1.0], [1.0, 2.0]]}, "theta = .* must be a number or an array of numbers$"),
        ({"theta": {"alpha": 1.0}}, r"theta = {'alpha': 1.0} must .* write problem.vector\(...\)"),
        ({"data": 1.0}, "data = 1.0 must have names"),
        ({"data": {"wind": 1.0}}, r"data has no 'wind' \(it has target, discs\)"),
    ],
)  # fmt: skip
def test_arguments_that_are_none_are_refused(fatrop, arguments, message):
    with pytest.raises(ValueError, match=message) as caught:
        fatrop.solve(**{"state": START, "theta": THETA} | arguments)
    assert "\n" not in str(caught.value)
