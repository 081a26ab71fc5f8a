"""What a `Problem` gives by name: theta, its gradient, and data of one stage or of all."""

import gc
import math
import weakref

import numpy as np
import pytest
from small_problems import open_field, pendulum, point_mass

from nmpcrl.control import Nmpc

pytestmark = pytest.mark.usefixtures("interpreted")


def test_theta_and_its_gradient_have_names_and_data_are_given_once_or_stage_by_stage():
    problem = pendulum()
    solution = Nmpc(problem).solve(np.array([0.4, 0.1]), problem.theta)
    by_name = problem.split(solution.features)
    assert isinstance(by_name["rate"], float)
    flat = np.concatenate([np.ravel(by_name[name]) for name in problem.names])
    np.testing.assert_array_equal(flat, solution.features)
    assert by_name["offset"] == pytest.approx(2 * 0.5 * math.cos(0.4))
    parts = problem.split(problem.vector(Q=[[1.0, 2.0], [3.0, 4.0]], r=7.0))
    np.testing.assert_array_equal(parts["Q"], [[1, 2], [3, 4]])
    assert (parts["r"], parts["rate"]) == (7.0, 1.3)
    assert problem.split(problem.theta_lower)["damping"] == 0.0
    assert problem.split(problem.theta_upper)["rate"] == np.inf
    with pytest.raises(ValueError, match="theta has no 'q'"):
        problem.vector(q=1.0)
    with pytest.raises(ValueError, match=r"theta 'Q' has shape \(4,\); it must be \(2, 2\)"):
        problem.vector(Q=np.ones(4))
    nmpc, state = Nmpc(pendulum()), np.array([0.3, -0.2])

    def value(**data):
        return nmpc.solve(state, nmpc.problem.theta, data=data).value

    once, late = value(target=[0.2, 0.1]), np.zeros((7, 2))
    late[6] = 1.0
    assert value(target=np.tile([0.2, 0.1], (7, 1))) == once != value()
    assert value(target=late) > once
    with pytest.raises(ValueError, match=r"data has no 'targt'; did you mean 'target'\?"):
        value(targt=0.0)
    allowed = r"data 'target' has shape \(3,\); it must be \(2,\) or \(7, 2\)"
    with pytest.raises(ValueError, match=allowed):
        value(target=np.zeros(3))


@pytest.mark.parametrize("solver", ["riccati", "fatrop"])
@pytest.mark.parametrize("make", [lambda: (pendulum(),), lambda: (point_mass(), open_field())])
def test_a_problem_a_plant_and_a_task_end_with_their_last_user(make, solver):
    given = make()
    nmpc = Nmpc(*given, solver=solver)
    theta = nmpc.problem.theta
    nmpc.value_hessian_times(nmpc.solve(np.full(nmpc.n, 0.3), theta), theta)
    alive = [weakref.ref(one) for one in (*given, nmpc, nmpc.problem)]
    del given, nmpc
    gc.collect()
    assert [one() for one in alive] == [None] * len(alive)
