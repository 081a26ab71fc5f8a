"""Times against a problem's sizes: what is measured and how it is counted, never how fast."""

import numpy as np
import pytest

from nmpcrl.bench import problem_sizes
from nmpcrl.bench.problem_sizes import Sizes, chain, measured, times
from nmpcrl.control import Nmpc


@pytest.mark.parametrize(
    "sizes", [Sizes(), Sizes(states=2), Sizes(inputs=3), Sizes(rows=0), Sizes(5 + 1, 2, 3, 4, 5)]
)
def test_a_chain_has_the_sizes_that_are_asked_for(sizes):
    problem = chain(sizes)
    found = (problem.states, problem.inputs, problem.horizon, problem.theta.size)
    assert (*found, problem.weights.size) == sizes
    state = np.full(sizes.states, 0.2)
    solution = Nmpc(problem, solver="ipopt").solve(state, problem.theta)
    assert 0 < solution.value < np.inf
    assert (solution.features != 0).all()  # every parameter matters


def test_there_is_a_row_for_every_size_and_no_problem_is_measured_twice(monkeypatch):
    monkeypatch.setattr(problem_sizes, "VARIED", {"states": (2, 4), "horizon": (5, 10)})
    asked = []

    def few(sizes):
        asked.append(sizes)
        return measured(sizes, solves=2, solver="ipopt")

    table = times(("states", "horizon"), measure=few)
    assert list(zip(table.varied, table["size"], strict=True)) == [
        ("states", 2), ("states", 4), ("horizon", 5), ("horizon", 10),
    ]  # fmt: skip
    assert len(asked) == 3  # Sizes() stands in both
    numbers = table[["first_s", "solve_us", "iterations", "hessian_us", "policy_us", "fatrop_us"]]
    assert (numbers > 0).all(axis=None)
