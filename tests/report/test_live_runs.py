"""What the figure of published runs is given: their very numbers, which lead to the same costs."""

import gzip
import json
import re
from base64 import b64decode

import numpy as np
import pytest

from nmpcrl.claims import published
from nmpcrl.learning import browser
from nmpcrl.learning.rollout import evaluate
from nmpcrl.report import live
from nmpcrl.report.live import published_runs
from nmpcrl.study import Experiment, design, paper

SAME = 1e-6  # relative: theta is published in single precision, which moves the cost by 1e-7


@pytest.fixture(scope="module")
def known():
    return published.load()


@pytest.fixture(scope="module")
def shown() -> str:
    """The figure's HTML, with a module of three bytes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(browser, "module", lambda plant, task: b"abc")
        return live.runs("DES", "RDES").data


def unpacked(packed: dict) -> dict:
    """Training costs, costs without noise, and theta, by learner, decay and seed."""
    planes = np.frombuffer(gzip.decompress(b64decode(packed["numbers"])), np.uint8)
    steps = np.ascontiguousarray(planes.reshape(4, -1).T).view("<u4")[:, 0]
    rows = np.cumsum(steps, dtype=np.uint32).view(np.float32).reshape(len(packed["runs"]), -1)
    parts = [np.split(row, [300, 331]) for row in rows]
    named = [(learner, decay, int(seed)) for learner, decay, seed in map(str.split, packed["runs"])]
    return {
        name: (training, costs, theta.reshape(9, 301).T)
        for name, (training, costs, theta) in zip(named, parts, strict=True)
    }


def assert_published(unpacked: dict, layout: str, known) -> None:
    for (learner, decay, seed), (training, costs, theta) in unpacked.items():
        one = known.summaries[Experiment(learner, layout=layout, decay=decay, seed=seed)]
        count = len(one.evaluations["cost"])
        np.testing.assert_array_equal(training, one.episodes["cost"])
        np.testing.assert_array_equal(costs[:count], one.evaluations["cost"])
        np.testing.assert_array_equal(theta[::10][:count], one.evaluations["theta"])
        assert np.isnan(costs[count:]).all()
        np.testing.assert_array_equal(theta[1:], one.episodes["theta"])


def test_a_page_is_given_one_seed_of_its_learners_and_of_the_frozen_arm(data, known):
    given = unpacked(data["given"])
    assert set(given) == {
        (learner, decay, 0)
        for learner in ("DES", "RDES", "frozen")
        for decay in ("step", "episode")
    }
    assert_published(given, "A", known)


@pytest.mark.slow
def test_each_layout_has_a_file_with_every_run_of_the_main_table_and_the_controls(known):
    files = published_runs.scripts()
    assert list(files) == [f"runs_{layout}.js" for layout in design.LAYOUTS]
    for layout, text in zip(design.LAYOUTS, files.values(), strict=True):
        runs = unpacked(json.loads(re.search(rf"{layout}: (.*) }};", text)[1]))
        parts = (*design.main_table(), *design.controls())
        assert set(runs) == {(e.learner, e.decay, e.seed) for e in parts if e.layout == layout}
        assert_published(runs, layout, known)
    assert sum(map(len, files.values())) < 5e6


@pytest.mark.parametrize("learner", ["ES", "DES", "RDES", "GES", "TDC", "QL"])
def test_the_published_theta_leads_to_the_published_cost(learner, known):
    e = Experiment(learner, layout="D", decay="episode", seed=1)
    found, controller = known.summaries[e].evaluations, paper.nmpc(e.layout)
    for theta, cost in zip(found["theta"][::10], found["cost"][::10], strict=True):
        rollout = evaluate(controller, theta.astype(float), paper.STEPS)
        assert rollout.cost == pytest.approx(cost, rel=SAME)


def test_a_page_may_begin_with_another_layout(monkeypatch, known):
    monkeypatch.setattr(browser, "module", lambda plant, task: b"abc")
    shown = live.runs("ES", "GES", layout="E").data
    data = json.loads(re.search(r'application/json">(.*)</script>', shown)[1])
    assert data["chosen"]["layout"] == "E"
    assert_published(unpacked(data["given"]), "E", known)
