"""The figure of moving obstacles: what it is given, and that its modules drive as Python does."""

import numpy as np
import pytest
from wasm_host import Controller, Module

from nmpcrl.analysis.encounters import count, judged
from nmpcrl.control import Nmpc
from nmpcrl.learning import browser
from nmpcrl.report import live
from nmpcrl.report.live import moving_obstacles
from nmpcrl.report.live.moving_obstacles import SCENE
from nmpcrl.study import moving, paper
from nmpcrl.study.moving import PREDICTORS, Straight, centres

THETA = np.array(paper.THETA_INIT)
ON_THE_START = (Straight((-1.5, 1.4), (0.1, 0.1)), *SCENE[1:])


@pytest.fixture(scope="module")
def shown() -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(browser, "module", lambda *of: b"abc" if len(of) == 2 else b"def")
        return live.moving().data


def test_it_is_given_the_studys_episode_and_clearance(data):
    assert (data["start"], data["theta"]) == (list(paper.START), list(paper.THETA_INIT))
    assert (data["steps"], len(data["movers"])) == (
        paper.STEPS,
        moving.problem().data.shape[1] // 2,
    )
    assert {clearance for *_, clearance in data["problem"]["discs"]} == {moving.CLEARANCE}
    assert set(data["looks"]) < set(PREDICTORS)
    movers = np.array(data["movers"])
    seventh = movers[:, :2] + 7 * data["period"] * movers[:, 2:]
    np.testing.assert_array_equal(seventh, centres(SCENE, [7])[0])


def test_the_scene_shows_what_the_chapter_says():
    """Who plans as if they stood gets inside; with a margin it does not, and pays for both."""
    seen = {}
    for c in (THETA[8], 0.301):
        theta = np.array([*THETA[:8], c])
        for view in moving_obstacles.LOOKS:
            found = judged(moving.controller(4), theta, moving.World(SCENE, PREDICTORS[view]))
            assert found.arrived
            seen[view, c > 0.3] = found
    assert seen["frozen", False].contacts.inside > 20
    for margin in (False, True):
        assert seen["extrapolated", margin].contacts.inside == 0
        assert seen["frozen", margin].cost > 1.3 * seen["extrapolated", margin].cost
    assert seen["frozen", True].contacts.inside == 0


@pytest.fixture(scope="module")
def modules() -> tuple[Controller, Controller]:
    nmpc = paper.controller(paper.task([one.centre for one in SCENE]))
    there = Controller(Module(browser.module(nmpc.plant, nmpc.task)), nmpc)
    planned = moving.problem()
    return there, Controller(Module(browser.module(planned)), Nmpc(planned))


@pytest.mark.slow
@pytest.mark.parametrize("view", moving_obstacles.LOOKS)
@pytest.mark.parametrize("motions", [SCENE, ON_THE_START], ids=["scene", "on the start"])
def test_the_modules_drive_as_python_does(modules, view, motions):
    """With an obstacle at the start, the best of several cold starts is another than the first."""
    (there, planner), state, plan = modules, np.array(paper.START), None
    states, cost = [], 0.0
    for t in range(paper.STEPS):
        plan = planner.solve(state, THETA, plan, data=PREDICTORS[view](motions, t))
        discs = np.column_stack([centres(motions, [t])[0], [moving.CLEARANCE] * len(motions)])
        states.append(state)
        cost += there.cost(state, plan["action"], discs)
        state = there.step(state, plan["action"])
    found = judged(moving.controller(4), THETA, moving.World(motions, PREDICTORS[view]))
    assert cost == pytest.approx(found.cost, rel=1e-6)
    assert count(np.array(states), motions) == found.contacts
