"""The paper in one file: its NMPC, ES, RDES, GES and Algorithm 1, with CasADi, NumPy and torch.

    python one_file.py GES 20     trains 20 episodes, and prints the cost of each and theta

Equation numbers are the paper's. What the paper leaves open is read as in the book's main study.
"""

import sys

import casadi as ca
import numpy as np
import torch

ALPHA, BETA, ZETA = 1e-7, 1e-8, 1e-2  # step sizes of theta, of w, and of Adam
GAMMA, OMEGA, DECAY = 0.97, 100.0, 0.99  # discount, price of a slack, c_epsilon
N, STEPS, BATCH, HIDDEN = 10, 130, 128, 64  # stages, steps of an episode, mini-batch, neurons
START, TARGET = np.array([-2.5, 1.5, 0.0]), np.array([8.5, 2.0, np.pi / 2])  # x, y [m], heading
LOWER, UPPER = [-3.0, -3.0, -np.inf], [9.0, 9.0, np.inf]  # of a state; the paper's box, mirrored
FASTEST = np.array([0.6, np.pi / 2])  # speed [m/s], turn rate [rad/s]
CENTRES = np.array([(0.5, 2.2), (3.0, 0.5), (5.5, 2.8), (7.0, 0.3)])  # layout A [m]
CLEARANCE = 0.5 + 2.0  # d_rob + d_obs [m]
THETA = np.array([1.0, 1.0, 0.05, 0.05, 0.05, 1.0, 1.0, 0.1, 0.001])


def model(s, a, period=0.2):
    """Eqs. (17) and (18): the robot, one step of Runge-Kutta 4."""
    slope = lambda s: ca.vertcat(a[0] * ca.cos(s[2]), a[0] * ca.sin(s[2]), a[1])  # noqa: E731
    k1 = slope(s)
    k2 = slope(s + period / 2 * k1)
    k3 = slope(s + period / 2 * k2)
    return s + period / 6 * (k1 + 2 * k2 + 2 * k3 + slope(s + period * k3))


def overlap(s):
    """Eq. (19): above 0 inside of an obstacle."""
    return 1 - 4 * ((s[0] - CENTRES[:, 0]) ** 2 + (s[1] - CENTRES[:, 1]) ** 2) / CLEARANCE**2


def cost(s, a):
    """Eq. (20), the stage cost of reinforcement learning."""
    away = s - TARGET
    near, penalty = np.linalg.norm(away) < 1.5, 50 * np.maximum(0, overlap(s) + 0.35).sum()
    return away**2 @ [1.0, 1.0, 0.1] + (np.linalg.norm(a) if near else penalty)


def controller():
    """Eq. (2) for Ipopt, and the gradient of its Lagrangian in theta, Eq. (8)."""
    x, u = ca.SX.sym("x", 3, N + 1), ca.SX.sym("u", 2, N)
    sigma, s, theta = ca.SX.sym("sigma", 4, N + 1), ca.SX.sym("s", 3), ca.SX.sym("theta", 9)
    discount, away = GAMMA ** np.arange(N + 1), x - TARGET
    value = OMEGA * ca.dot(discount, ca.sum1(sigma).T)
    equal, below = [x[:, 0] - s], [overlap(x[:, i]) + theta[8] - sigma[:, i] for i in range(N + 1)]
    for i in range(N):
        stage = ca.sumsqr(theta[:3] * away[:, i]) + ca.sumsqr(theta[3:5] * u[:, i])
        value += discount[i] * stage
        equal.append(x[:, i + 1] - model(x[:, i], u[:, i]))
    value += discount[N] * ca.sumsqr(theta[5:8] * away[:, N])
    z, p, g = ca.veccat(x, u, sigma), ca.vertcat(s, theta), ca.vertcat(*equal, *below)
    quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
    solver = ca.nlpsol("nmpc", "ipopt", {"x": z, "p": p, "f": value, "g": g}, quiet)
    lam = ca.SX.sym("lam", g.numel())
    return solver, ca.Function("phi", [z, p, lam], [ca.gradient(value + ca.dot(lam, g), theta)])


SOLVER, GRADIENT = controller()
NONE, FREE = np.zeros(4 * (N + 1)), np.full(3, np.inf)  # x_0 is given, inside the box or not
BOUNDS = {
    "lbx": np.concatenate([-FREE, np.tile(LOWER, N), np.tile(-FASTEST, N), NONE]),
    "ubx": np.concatenate([FREE, np.tile(UPPER, N), np.tile(FASTEST, N), NONE + np.inf]),
    "lbg": np.concatenate([np.zeros(3 * (N + 1)), NONE - np.inf]),
    "ubg": 0,
}


def solve(s, theta, guess=None):
    """The value, its gradient in theta, and the plan (x, u, sigma), from a guess or at rest."""
    guess = guess or [np.tile(s, (N + 1, 1)), np.zeros((N, 2)), np.zeros((N + 1, 4))]
    p = np.concatenate([s, theta])
    found = SOLVER(x0=np.concatenate([part.ravel() for part in guess]), p=p, **BOUNDS)
    assert SOLVER.stats()["success"], f"Ipopt found no plan from {s} with theta = {theta}"
    parts = np.split(found["x"].full().ravel(), [3 * (N + 1), 5 * N + 3])
    plan = [part.reshape(-1, width) for part, width in zip(parts, (3, 2, 4), strict=True)]
    return float(found["f"]), GRADIENT(found["x"], p, found["lam_g"]).full().ravel(), plan


def shifted(plan):
    """A plan a stage later, as a guess for the next state."""
    return [np.vstack([part[1:], part[-1:]]) for part in plan]


def minibatch(count):
    """Which of so many examples are learned from in a step."""
    return torch.randperm(count)[:BATCH]


class Network:
    """Eqs. (10) and (11): Q(s, a, theta), taught by the NMPC's values."""

    def __init__(self, seed):
        torch.manual_seed(seed)
        layers = [torch.nn.Linear(14, HIDDEN), torch.nn.ReLU(), torch.nn.Linear(HIDDEN, HIDDEN)]
        self.model = torch.nn.Sequential(*layers, torch.nn.ReLU(), torch.nn.Linear(HIDDEN, 1))
        self.adam = torch.optim.Adam(self.model.parameters(), lr=ZETA)
        self.examples = []

    def __call__(self, given, value, asked):
        """Remember an example, fit, and predict; None before the first fit."""
        self.examples.append(np.concatenate([*given, [value]]))
        if len(self.examples) < BATCH:
            return None
        rows = minibatch(len(self.examples))
        batch = torch.tensor(np.array([self.examples[row] for row in rows])).float()
        loss = ((self.model(batch[:, :-1])[:, 0] - batch[:, -1]) ** 2).mean()
        self.adam.zero_grad()
        loss.backward()
        self.adam.step()
        return self.model(torch.tensor(np.concatenate(asked)).float()).item()


def train(learner, episodes, seed=0):
    """Algorithm 1; yields the summed cost and theta after each episode."""
    drawn, first = (np.random.default_rng(each) for each in np.random.SeedSequence(seed).spawn(2))
    noise = drawn.normal(size=(episodes, STEPS, 2))
    noise *= DECAY ** np.arange(episodes * STEPS).reshape(episodes, STEPS, 1)  # Eq. (5)
    network, theta, w = Network(int(first.integers(2**63))), THETA, np.full(9, 1e-4)
    for episode in noise:
        s, guess, total = START, None, 0.0
        for epsilon in episode:
            q, phi, plan = solve(s, theta, guess)
            a = np.clip(plan[1][0] + epsilon, -FASTEST, FASTEST)
            later, paid = model(s, a).full().ravel(), cost(s, a)
            if learner == "RDES":
                guess = shifted(plan)
                q_next = network((s, a, theta), q, (later, plan[1][1], theta))
            else:  # a second solve, whose plan is the next guess
                q_next, phi_next, guess = solve(later, theta, shifted(plan))
            if q_next is not None:
                delta = paid + GAMMA * q_next - q  # Eqs. (7) and (11)
                if learner == "GES":  # Eq. (16)
                    theta = theta + ALPHA * (delta * phi - GAMMA * (w @ phi) * phi_next)
                    w = w + BETA * (delta - phi @ w) * phi
                else:  # Eq. (9)
                    theta = theta + ALPHA * delta * phi
            s, total = later, total + paid
        yield total, theta


if __name__ == "__main__":
    for number, (summed, after) in enumerate(train(sys.argv[1], int(sys.argv[2]))):
        print(f"episode {number + 1}: cost {summed:.1f}, theta {np.round(after, 4)}")
