"""The solver of a page remakes its problem where horizon and obstacles change, as Python does."""

import gzip
from base64 import b64encode
from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.control import Nmpc, Obstacle
from nmpcrl.report.live.problem import LONGEST, problem_of
from nmpcrl.report.prose import ROOT
from nmpcrl.study import paper
from nmpcrl.study.geometry import MOST_OBSTACLES

SOLVED = """async ({ module, problem, asked }) => {
  const nmpc = await window.nmpcrl.solver(module, problem)
  return asked.map(({ action, next, ...given }) => {
    const plan = nmpc.solve(given), warm = nmpc.solve({ ...given, state: next }, { warm: plan })
    const q = nmpc.solve({ ...given, state: next }, { warm, action })
    const { cost } = nmpc.rollout({ ...given, start: given.state }, 5)
    return [plan, warm, q].map(({ value, features, action, states, iterations }) => (
      { value, features, action, states, iterations }
    )).concat({ cost })
  })
}"""
THETA = np.array(paper.THETA_INIT)


def test_plans_are_those_of_python(browser, robot_module):
    rng = np.random.default_rng(0)
    page, expected, asked = browser.new_page(), [], []
    page.add_script_tag(content=(ROOT / "book/_static/live/solver.js").read_text("utf-8"))
    for horizon, count in ((10, 4), (1, 2), (20, 0), (7, 16), (LONGEST, 1), (10, 4)):
        obstacles = tuple(Obstacle(*rng.uniform([1, -1], [8, 4])) for _ in range(count))
        target = paper.TARGET + rng.uniform(-0.3, 0.3, 3)
        task = replace(paper.task("A"), obstacles=obstacles, target=target)
        nmpc, state = Nmpc(paper.nmpc().plant, task, horizon), task.start + [0.1, 0.2, 0.3]
        plan, action = nmpc.solve(state, THETA), np.array([0.3, -0.2])
        later = nmpc.plant.step(state, plan.action)
        warm = nmpc.solve(later, THETA, plan)
        given = {"state": state, "next": later, "theta": THETA, "target": target}
        given |= {"action": action, "horizon": horizon}
        given["discs"] = np.transpose(task.discs)
        asked.append({name: np.asarray(value).tolist() for name, value in given.items()})
        q = nmpc.solve(later, THETA, warm, action)
        cost, there, at = 0.0, state, None
        for _ in range(5):
            at = nmpc.solve(there, THETA, at)
            cost += task.stage_cost(there, at.action)
            there = nmpc.plant.step(there, at.action)
        expected.append(((plan, warm, q), cost))
    assert MOST_OBSTACLES in [len(one["discs"]) for one in asked]
    module = b64encode(gzip.compress(robot_module)).decode()
    problem = problem_of(paper.nmpc("A"))
    found = page.evaluate(SOLVED, {"module": module, "problem": problem, "asked": asked})
    page.close()
    for (solutions, cost), (*plans, last) in zip(expected, found, strict=True):
        for solution, plan in zip(solutions, plans, strict=True):
            assert plan["iterations"] == solution.iterations
            for name in ("value", "features", "action", "states"):
                np.testing.assert_allclose(
                    plan[name], getattr(solution, name), rtol=1e-8, atol=1e-8
                )
        assert last["cost"] == pytest.approx(cost, rel=1e-8)
