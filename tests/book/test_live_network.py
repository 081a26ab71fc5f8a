"""The network that a page fits: its first weights, and the runs of Python."""

import gzip
from base64 import b64encode

import numpy as np
import pytest

from nmpcrl.learning.network import DRAW, QNetwork
from nmpcrl.report.live import frame, noise, two_learners
from nmpcrl.report.live.problem import problem_of
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.setup import controller_of

SCRIPTS = ("solver.js", "random.js", "network.js", "learning.js")
HIDDEN = paper.HIDDEN
SEEDS = (0, 1, 2, 7, 2**31 - 1)
DRAWN = """([seeds, inputs]) => seeds.map(seed => {
  const { generator, firstWeights } = window.nmpcrl
  const drawn = generator(seed), first = drawn.integer63()
  const weights = inputs.map(count => Array.from(firstWeights([count, 64, 64, 1], first)))
  return { weights, draw: String(drawn.integer63()) }
})"""
TRAINED = """async ({ module, problem, settings, widths }) => {
  const { solver, normal, train } = window.nmpcrl, nmpc = await solver(module, problem)
  const count = settings.episodes * settings.steps * problem.lower.length
  const noise = normal(settings.seed, count, widths)
  return Array.from(train(nmpc, settings, noise), ({ theta, nextValue }) => ({ theta, nextValue }))
}"""


DIVERGED = """async ({ module, problem, settings }) => {
  const { solver, train } = window.nmpcrl, nmpc = await solver(module, problem)
  const noise = new Float64Array(2 * settings.episodes * settings.steps)
  return Array.from(train(nmpc, settings, noise), ({ diverged }) => diverged)
}"""


@pytest.fixture(scope="module")
def page(browser):
    """A page with the scripts that learn, and nothing else."""
    page = browser.new_page()
    for name in SCRIPTS:
        page.add_script_tag(content=(frame.folder() / name).read_text("utf-8"))
    yield page
    page.close()


def numpys(seed: int) -> np.random.Generator:
    """The generator of a run's network."""
    return np.random.default_rng(np.random.SeedSequence(seed).spawn(3)[1])


def test_a_network_begins_as_in_python_in_every_bit(page):
    """Its weights, which torch draws, and the state of the generator of its mini-batches."""
    inputs = (5, 14)
    for seed, drawn in zip(SEEDS, page.evaluate(DRAWN, [SEEDS, inputs]), strict=True):
        for count, weights in zip(inputs, drawn["weights"], strict=True):
            expected = QNetwork(count, numpys(seed), hidden=HIDDEN)
            assert (np.array(weights, np.float32) == expected.weights).all()
            assert int(drawn["draw"]) == expected.net[DRAW][0]


def test_a_divergence_is_what_the_library_calls_one(page, robot_module):
    """The page holds no number of its own: with others it ends elsewhere."""
    experiment = Experiment(episodes=12, steps=1)
    settings = given_to_page(robot_module, experiment)["settings"]
    limits = settings["limits"]

    def diverged(**changes):
        given = given_to_page(robot_module, experiment)
        return page.evaluate(DIVERGED, given | {"settings": settings | changes})

    nowhere = [float("nan"), 0.0, 0.0]  # where no solve finds a plan
    for patience in (limits["patience"], 3):
        found = diverged(start=nowhere, limits=limits | {"patience": patience})
        assert found == [False] * (patience - 1) + [True]
    assert diverged(limits=limits | {"absurd": 0.5}) == [True]
    assert diverged() == [False] * experiment.episodes


def test_a_network_of_another_size_is_that_of_the_library(page, robot_module, monkeypatch):
    monkeypatch.setattr(paper, "BATCH", 16)
    monkeypatch.setattr(paper, "HIDDEN", 8)
    assert_a_run_is_that_of_the_library(page, robot_module, Experiment("RDES", episodes=1))


@pytest.mark.parametrize("learner", ["DES", "RDES"])
@pytest.mark.parametrize(("layout", "decay", "seed"), [("A", "step", 0), ("C", "episode", 1)])
def test_a_run_is_that_of_the_library(page, robot_module, learner, layout, decay, seed):
    """Equal until the first fit, then to single precision; 4e-7 is the farthest seen so early."""
    experiment = Experiment(learner=learner, layout=layout, decay=decay, seed=seed, episodes=2)
    assert_a_run_is_that_of_the_library(page, robot_module, experiment)


def given_to_page(robot_module: bytes, experiment: Experiment) -> dict:
    nmpc = controller_of(experiment)
    given = {name: getattr(experiment, name) for name in ("alpha", "decay", "seed")}
    return {
        "module": b64encode(gzip.compress(robot_module)).decode(),
        "problem": problem_of(nmpc),
        "settings": two_learners.settings(experiment, experiment.learner, nmpc) | given,
        "widths": noise.widths(),
    }


def assert_a_run_is_that_of_the_library(page, robot_module, experiment: Experiment) -> None:
    found = page.evaluate(TRAINED, given_to_page(robot_module, experiment))
    expected = run(experiment).steps
    before = paper.BATCH - 1  # steps without a fit
    theta = np.array([step["theta"] for step in found])
    np.testing.assert_array_equal(theta[:before], expected["theta"][:before])
    values = np.array([step["nextValue"] for step in found])
    assert np.isnan(values[:before]).all()
    assert np.isfinite(values[before:]).any()
    for these, those in ((theta, expected["theta"]), (values, expected["next_value"])):
        np.testing.assert_allclose(these, those, rtol=0, atol=1e-5 * np.nanmax(np.abs(those)))
