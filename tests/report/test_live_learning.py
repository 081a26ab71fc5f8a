"""What the live figures of learners are given: the chain and the experiment that Python has."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis import two_state
from nmpcrl.control.nmpc import ABSURD, FAR
from nmpcrl.learning import browser, training
from nmpcrl.report import live
from nmpcrl.report.live import two_learners, two_states
from nmpcrl.study import Experiment, paper
from nmpcrl.study.setup import prepare

EXPERIMENT = Experiment(layout="C", alpha=3e-8, decay="episode", seed=4, episodes=20, horizon=7)
FIGURES = {
    "chain": (lambda: live.chain(0.1, 0.4, 0.97), two_states.SCRIPTS),
    "learners": (lambda: live.learners(EXPERIMENT), two_learners.SCRIPTS),
    "networks": (lambda: live.networks(EXPERIMENT), two_learners.WITH_NETWORK),
}


@pytest.fixture(autouse=True)
def module_of_three_bytes(monkeypatch):
    monkeypatch.setattr(browser, "module", lambda plant, task: b"abc")


def data_of(figure: str) -> dict:
    html = FIGURES[figure][0]().data
    return json.loads(re.search(r'application/json">(.*)</script>', html)[1])


def test_the_chain_is_that_of_the_analysis():
    data = data_of("chain")
    chain = two_state.Chain(gamma=0.97)
    for state in (two_state.FIRST, two_state.SECOND):
        phi, phi_next = data["phi"][state][0], data["phi_next"][state][0]
        delta = data["cost"] + 0.97 * phi_next * data["theta"] - phi * data["theta"]
        assert delta == pytest.approx(chain.delta(np.array([data["theta"]]), state))


@pytest.mark.parametrize("figure", ["learners", "networks"])
def test_both_learners_begin_as_the_experiment_does(figure):
    data = data_of(figure)
    assert data["given"] == {"alpha": 3e-8, "decay": "episode", "seed": 4}
    nmpc = paper.nmpc("C", horizon=7)
    _, weights, explore = prepare(EXPERIMENT, nmpc)
    for learner, settings in data["settings"].items():
        assert settings["learner"] == learner
        assert settings["theta"] == weights.theta.tolist()
        assert settings["w"] == weights.w.tolist()
        assert [settings["episodes"], settings["steps"]] == list(explore.noise.shape[:2])
        assert settings["discs"] == np.column_stack(nmpc.task.discs).tolist()
        assert settings["horizon"] == 7
        assert settings["beta"] == paper.BETA
        assert settings["zeta"] == paper.ZETA
        assert settings["limits"] == {
            "absurd": ABSURD,
            "far": FAR,
            "patience": training.PATIENCE,
        }
        assert settings["network"] == {"hidden": paper.HIDDEN, "batch": paper.BATCH}


def test_networks_are_fitted_for_sixty_episodes_at_most(monkeypatch):
    for asked, shown in ((300, 60), (12, 12)):
        monkeypatch.setitem(globals(), "EXPERIMENT", replace(EXPERIMENT, episodes=asked))
        settings = data_of("networks")["settings"]
        assert list(settings) == ["DES", "RDES"]
        assert {one["episodes"] for one in settings.values()} == {shown}


@pytest.mark.parametrize("changes", [{"network": "tanh"}, {"gated": False}])
def test_a_network_that_a_page_does_not_have_is_refused(changes):
    ((name, value),) = changes.items()
    with pytest.raises(ValueError, match=re.escape(f"{name} = {value!r}")):
        live.networks(replace(EXPERIMENT, learner="RDES", **changes))
