"""`Nmpc.gradient`: derivatives of value and plan in state, theta, u_0 and data, by differences."""

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from differences import active
from small_problems import drawn, limited, pendulum, tank

from nmpcrl.control import Fatrop, Nmpc, Riccati, Solution, SolverError

STEP = 1e-5


def asked(nmpc: Nmpc, rng: np.random.Generator, *, fixed: bool) -> dict[str, Any]:
    """What a solve is given."""
    of = nmpc.problem
    known = {name: of.data_names.part(name, of.data) for name in of.data_names}
    data = {name: one.reshape(-1, *of.data_names[name]) for name, one in known.items()}
    return {
        "state": rng.uniform(-0.9, 0.9, nmpc.n) * of.sizes[0],
        "theta": of.theta + 0.1 * rng.uniform(-1, 1, of.theta.size),
        "action": 0.5 * rng.uniform(nmpc.lower, nmpc.upper) if fixed else None,
        "data": {name: one + 0.05 * rng.normal(size=one.shape) for name, one in data.items()},
    }


def directions(nmpc: Nmpc, given: dict[str, Any], rng: np.random.Generator) -> Iterator[Any]:
    """A direction of each thing that is given: its name, and it moved along so far."""

    def moved(part: str, along: Any) -> Callable[[float], dict[str, Any]]:
        return lambda length: given | {part: given[part] + length * along}

    sizes = {"state": nmpc.problem.sizes[0], "action": nmpc.problem.sizes[1]}
    for part in ("state", "theta", "action"):
        if given[part] is not None:
            along = rng.normal(size=given[part].shape) * sizes.get(part, 1.0)
            yield part, along, moved(part, along)
    for name, one in given["data"].items():
        along = rng.normal(size=one.shape)
        data = lambda length, name=name, by=along: {name: given["data"][name] + length * by}  # noqa: E731
        yield name, along, lambda by, data=data: given | {"data": given["data"] | data(by)}


def difference(nmpc: Nmpc, here: Solution, number: Any, moved: Any) -> float | None:
    """The central difference of a number; None across a kink."""
    above, below = (nmpc.solve(**moved(length), warm_start=here) for length in (STEP, -STEP))
    if active(here) is None or {active(above), active(below)} != {active(here)}:
        return None
    return float(number(above) - number(below)) / (2 * STEP)


@pytest.mark.parametrize(
    ("solver", "points"),
    [
        pytest.param(Riccati(1e-11), 8, id="riccati"),
        pytest.param(Fatrop(1e-10), 8, id="fatrop"),
        pytest.param(Riccati(1e-11), 200, id="200 points", marks=pytest.mark.weekly),
    ],
)
@pytest.mark.parametrize(
    "make",
    [pendulum, limited, partial(tank, 1e-6), partial(drawn, 11)],
    ids=["P", "H", "T", "one state"],
)
def test_derivatives_along_any_direction_are_differences(make, solver, points, request):
    if make is not pendulum:
        request.getfixturevalue("interpreted")
    nmpc, rng, compared = Nmpc(make(), solver=solver), np.random.default_rng(0), Counter()
    missed = 0
    for k in range(points):
        given = asked(nmpc, rng, fixed=k % 2 == 1)
        try:
            here = nmpc.solve(**given)
        except SolverError:  # fatrop, where no plan keeps to hard rows
            continue
        w, v = (rng.normal(size=one.shape) for one in (here.inputs, here.states))
        w, v = w / nmpc.problem.sizes[1], v / nmpc.problem.sizes[0]

        def plan(one, w=w, v=v):
            return (w * one.inputs).sum() + (v * one.states).sum()

        kinds = {
            "value": (nmpc.gradient(here), lambda one: one.value),
            "plan": (nmpc.gradient(here, value=0.0, inputs=w, states=v), plan),
        }
        for kind, (found, number) in kinds.items():
            for name, along, moved in directions(nmpc, given, rng):
                slope = None if here.violation else difference(nmpc, here, number, moved)
                if slope is not None:
                    part = found.data[name] if name in found.data else getattr(found, name)
                    near = pytest.approx(slope, rel=1e-4, abs=2e-5)
                    missed += (part * along).sum() != near
                    compared[kind, name] += 1
        np.testing.assert_allclose(kinds["value"][0].theta, here.features, rtol=1e-6, atol=1e-8)
    assert missed <= points // 100  # next to a kink, where the error of a solve shows
    assert len(compared) == 2 * (3 + len(nmpc.problem.data_names))
    assert min(compared.values()) >= 2, compared


@pytest.mark.parametrize("solver", ["riccati", "fatrop"])
def test_a_batch_has_the_gradient_of_each_and_zeros_where_a_solve_failed(solver):
    nmpc, rng = Nmpc(pendulum(), solver=solver), np.random.default_rng(0)
    states = np.vstack([rng.uniform(-0.9, 0.9, (4, 2)), [[np.nan, 0.0]]])
    batch = nmpc.solve_many(states, nmpc.problem.theta, actions=rng.uniform(-1, 1, (5, 1)))
    value, inputs = rng.normal(size=5), rng.normal(size=(5, 6, 1))
    found = nmpc.gradient(batch, value, inputs)
    for k in range(4):
        one = nmpc.gradient(batch[k], value[k], inputs[k])
        for part in ("state", "theta", "action"):
            np.testing.assert_allclose(getattr(found, part)[k], getattr(one, part), atol=1e-12)
        np.testing.assert_allclose(found.data["wind"][k], one.data["wind"], atol=1e-12)
    assert not found.theta[4].any()
    with pytest.raises(ValueError, match=r"inputs has shape \(6, 1\); it must be \(5, 6, 1\)"):
        nmpc.gradient(batch, value, inputs[0])
