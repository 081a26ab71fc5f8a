"""What a live figure displays: the library's own problem, whole scripts, and words if it cannot."""

import gzip
import json
import re
from base64 import b64decode

import numpy as np
import pytest
from builders import raising

from nmpcrl.control import browser as alone
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report import live
from nmpcrl.report.live import closed_loop, frame
from nmpcrl.study import paper
from nmpcrl.study.geometry import MOST_OBSTACLES

THETA = np.array(paper.THETA_INIT)


@pytest.fixture(scope="module")
def nmpc():
    return paper.nmpc("C", horizon=7)


@pytest.fixture
def small(monkeypatch) -> None:
    """A module of three bytes."""
    monkeypatch.setattr(browser, "module", lambda plant, task: b"abc")


@pytest.fixture
def shown(nmpc, small) -> str:
    """The figure's HTML."""
    return live.controller(nmpc, THETA, 130).data


def given(shown: str) -> dict:
    """What the script is given."""
    return json.loads(re.search(r'application/json">(.*)</script>', shown)[1])


def test_the_problem_is_the_one_that_the_controller_solves(nmpc, data):
    """But for the longest horizon and an obstacle, of which a page makes what is asked."""
    shown, own = data["problem"], alone.problem(nmpc.problem)
    for name in ("lower", "upper", "sides", "tie", "states", "inputs", "theta", "tolerance"):
        assert shown[name] == own[name]
    assert shown["discount"][:8] == own["discount"]
    assert [one[:7] for one in shown["drawn"]] == own["drawn"]
    assert [one[:7] for one in shown["others"]] == own["others"]
    assert shown["weights"] * 4 == own["weights"]
    assert [shown["target"], *shown["discs"]] == [
        nmpc.task.target.tolist(),
        *np.transpose(nmpc.task.discs).tolist(),
    ]
    assert shown["most_discs"] == MOST_OBSTACLES


def test_each_slider_has_a_step_at_its_first_value(data):
    first = dict(zip(data["names"], data["theta"], strict=True)) | {"horizon": data["horizon"]}
    assert set(data["ranges"]) == set(first)
    for name, (least, most, step) in data["ranges"].items():
        assert least < first[name] < most
        steps = (first[name] - least) / step
        assert steps == pytest.approx(round(steps), abs=1e-9)


def test_the_map_shows_the_start_the_target_and_every_circle(nmpc, data):
    x, y, width, height = data["view"]
    low, high = np.array([x, y]), np.array([x + width, y + height])
    for place in (nmpc.task.start[:2], nmpc.task.target[:2]):
        assert (low < place).all()
        assert (place < high).all()
    for *centre, clearance in data["problem"]["discs"]:
        assert (low < np.array(centre)).all()
        assert (np.array(centre) + clearance / 2 < high).all()


def test_the_output_is_whole_and_loads_nothing(shown):
    assert re.findall(r'data-file="([^"]+)"', shown) == [
        frame.STYLE,
        frame.MODULE,
        *closed_loop.SCRIPTS,
    ]
    assert not re.search(r"\b(src|href)=|https?://(?!www\.w3\.org/2000/svg)", shown)
    packed = b64decode(re.search(r'module: "([^"]+)"', shown)[1])
    assert gzip.decompress(packed) == b"abc"


def test_without_a_compiler_there_is_a_sentence(nmpc, monkeypatch):
    monkeypatch.setattr(browser, "module", raising(CannotCompile("numba is not installed")))
    assert live.controller(nmpc, THETA, 130).data == (
        "<p>There is no live figure here: numba is not installed.</p>"
    )


SLIDING = np.array([4.4, 1.9, 0.1])  # near obstacle 3 of layout C, not on it


def test_the_kinks_boundaries_are_where_the_slack_begins(nmpc, small):
    data = given(live.kink(nmpc, SLIDING, THETA).data)
    x, y, _ = nmpc.task.discs
    for k, radius in enumerate(data["boundaries"]):
        on_it = np.array([x[k] + radius * np.cos(1.0), y[k] + radius * np.sin(1.0), 0.0])
        assert nmpc.task.overlap(on_it)[k] == pytest.approx(-THETA[8])
