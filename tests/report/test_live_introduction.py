"""What the introduction's live figure is given: the study's own run, and two of its layouts."""

import pytest

from nmpcrl.learning import browser
from nmpcrl.report import live
from nmpcrl.report.live import introduction
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
