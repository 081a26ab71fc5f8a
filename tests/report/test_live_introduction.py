"""What the introduction's live figure is given: the study's own run, and two of its layouts."""

import re

import numpy as np
import pytest
from builders import raising

from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report import live
from nmpcrl.report.live import frame, introduction
from nmpcrl.study import Experiment, layouts, paper


@pytest.fixture(scope="module")
def shown() -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(browser, "module", lambda plant, task: b"abc")
        return live.intro().data


def test_it_trains_the_run_of_the_study(data):
    experiment, settings = Experiment(learner="ES"), data["settings"]
    for name in ("learner", "alpha", "decay", "seed", "episodes", "steps", "horizon"):
        assert settings[name] == getattr(experiment, name)
    assert settings["decayRate"] == experiment.decay_rate
    assert settings["theta"] == data["theta"] == list(experiment.theta)


def test_one_layout_is_open_and_the_other_closing(data):
    for kind, name in (("wide", introduction.WIDE), ("narrow", introduction.NARROW)):
        centres = [disc[:2] for disc in data["layouts"][kind]]
        assert centres == [list(one) for one in paper.LAYOUTS[name]]
    assert layouts.screen(paper.LAYOUTS[introduction.WIDE]).kind == "open"
    assert layouts.screen(paper.LAYOUTS[introduction.NARROW]).kind == "closing"


def test_the_map_shows_both_layouts_whole(data):
    left, bottom, width, height = data["view"]
    for x, y, clearance in np.concatenate(list(data["layouts"].values())):
        assert left <= x - clearance / 2
        assert x + clearance / 2 <= left + width
        assert bottom <= y - clearance / 2 + 1e-9
        assert y + clearance / 2 <= bottom + height + 1e-9


def test_all_its_files_are_there_once(shown):
    names = re.findall(r'data-file="([^"]+)"', shown)
    scripts = introduction.SCRIPTS
    assert names == [frame.STYLE, *introduction.STYLES, frame.MODULE, *scripts]


def test_without_a_compiler_there_is_a_sentence(monkeypatch):
    monkeypatch.setattr(browser, "module", raising(CannotCompile("numba is not installed")))
    assert "There is no live figure here" in live.intro().data
