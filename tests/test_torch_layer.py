"""The layer of `nmpcrl.torch`: torch's own checks, and a value that torch can work out itself."""

import casadi as ca
import numpy as np
import pytest
import torch
from small_problems import limited, pendulum

from nmpcrl.control import Fatrop, Nmpc, Problem, Riccati
from nmpcrl.torch import Layer

HOW = {"eps": 1e-5, "atol": 1e-4, "rtol": 1e-4}


def tensor(numbers) -> torch.Tensor:
    return torch.tensor(numbers, dtype=torch.float64, requires_grad=True)


def given(layer: Layer) -> list[torch.Tensor]:
    """States, thetas, two kinds of data, and actions, of three problems."""
    rng, of = np.random.default_rng(0), layer.nmpc.problem
    thetas = of.theta + 0.1 * rng.uniform(-1, 1, (3, of.theta.size))
    wind, target = 0.05 * rng.normal(size=(3, 7)), 0.3 * rng.normal(size=2)
    parts = 0.4 * rng.normal(size=(3, 2)), thetas, wind, target, rng.uniform(-1, 1, (3, 1))
    return [tensor(part) for part in parts]


def test_torch_confirms_all_derivatives():
    layer = Layer(Nmpc(pendulum(), solver=Riccati(1e-11)))
    *parts, actions = given(layer)

    def free(states, thetas, wind, target):
        return layer(states, thetas, {"wind": wind, "target": target})

    def fixed(states, thetas, wind, target, action):
        return layer(states, thetas, {"wind": wind, "target": target}, action=action)

    assert torch.autograd.gradcheck(free, parts, **HOW)
    assert torch.autograd.gradcheck(fixed, [*parts, actions], **HOW)


def test_the_layer_of_a_linear_quadratic_problem_is_riccatis_recursion():
    problem = Problem(
        states=2, inputs=1, horizon=5, gamma=0.9,
        theta={"A": [[1.0, 0.2], [-0.1, 0.9]], "B": [0.1, 0.3]},
        model=lambda x, u, th: th["A"] @ x + th["B"] * u,
        stage=lambda x, u, th: ca.sumsqr(x) + 0.1 * u**2,
        terminal=lambda x, th: 2 * ca.sumsqr(x),
    )  # fmt: skip
    states, theta = tensor([[1.0, -0.5], [0.2, 0.7]]), tensor(problem.theta)
    A, B = theta[:4].reshape(2, 2), theta[4:].reshape(2, 1)
    P, gains = 2 * torch.eye(2, dtype=torch.float64), []
    for _ in range(5):
        K = torch.linalg.solve(0.1 + 0.9 * B.T @ P @ B, 0.9 * B.T @ P @ A)
        P = torch.eye(2) + 0.1 * K.T @ K + 0.9 * (A - B @ K).T @ P @ (A - B @ K)
        gains.append(K)
    value, action, plan = Layer(Nmpc(problem, solver=Fatrop(1e-10)))(states, theta)
    for ours, theirs in (
        (value, ((states @ P) * states).sum(1)),
        (action, -states @ K.T),
        (plan[:, 1], -(states @ (A - B @ K).T) @ gains[-2].T),
    ):
        torch.testing.assert_close(ours, theirs, rtol=1e-6, atol=1e-7)
        found, expected = (
            torch.autograd.grad(one.sum(), (states, theta), retain_graph=True)
            for one in (ours, theirs)
        )
        torch.testing.assert_close(found, expected, rtol=1e-5, atol=1e-6)


def test_a_failed_solve_is_masked_and_has_no_gradient():
    layer = Layer(Nmpc(limited(), solver="fatrop"))  # no plan from the second state keeps its rows
    states, theta = tensor([[0.1, 0.0], [0.0, 9.0], [0.2, 0.0]]), tensor(layer.nmpc.problem.theta)
    value, action, plan = layer(states, theta)
    mask = value.isfinite()
    assert mask.tolist() == [True, False, True]
    assert action.isfinite().all(1).equal(mask)
    (value[mask].sum() + plan[mask].square().sum()).backward()
    assert states.grad[1].tolist() == [0.0, 0.0]
    assert (states.grad[[0, 2]].abs().sum(1) > 0).all()
    assert theta.grad.isfinite().all()


@pytest.mark.parametrize("solver", ["riccati", "fatrop"])
def test_a_network_in_single_precision_learns_through_one_theta_for_all(solver):
    layer = Layer(Nmpc(pendulum(), solver=solver))
    nmpc, states = layer.nmpc, torch.tensor([[0.3, 0.1], [-0.2, 0.4]])
    theta = torch.tensor(nmpc.problem.theta, dtype=torch.float32, requires_grad=True)
    value, _, plan = layer(states, theta)
    assert value.dtype == plan.dtype == torch.float64
    (value.sum() + 2 * plan.sum()).backward()
    assert theta.grad.dtype == torch.float32
    known = theta.detach().numpy()
    each = [nmpc.solve(state, known) for state in states.numpy()]
    expected = sum(nmpc.gradient(one, inputs=2 * np.ones((6, 1))).theta for one in each)
    np.testing.assert_allclose(theta.grad, expected, rtol=1e-5, atol=1e-6)


def test_a_shape_is_refused_with_the_one_to_give():
    layer = Layer(Nmpc(pendulum(), solver="fatrop"))
    states, thetas, wind, _, actions = given(layer)
    for asked, action, said in (
        ((states[0], thetas), None, r"states has shape \(2,\); it must be \(2, 2\)"),
        ((states, thetas[:, :9]), None, r"theta has shape \(3, 9\); it must be \(3, 10\)"),
        ((states, thetas, {"wind": wind[:, :6]}), None, r"wind has shape \(3, 6\); it must be \(3"),
        ((states, thetas, {"wnd": wind}), None, "data has no 'wnd'; did you mean 'wind'"),
        ((states, thetas), actions[:2], r"action has shape \(2, 1\); it must be \(3, 1\)"),
    ):
        with pytest.raises(ValueError, match=said):
            layer(*asked, action=action)
    plain = states.tolist(), thetas.tolist(), {"wind": wind.detach().numpy()}
    assert layer(*plain)[0].equal(layer(states, thetas, {"wind": wind})[0])
