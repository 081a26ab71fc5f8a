"""What the laboratory is given: the library's own settings, looks and noise."""

import json

import numpy as np
import pytest

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.learning import browser
from nmpcrl.report import live
from nmpcrl.report.examples import Example, first_rollout
from nmpcrl.report.live import noise, training
from nmpcrl.study import Experiment, ParameterError, paper

FIND = Example("One", "See.", {}, Experiment(seed=3), "Look.")


@pytest.fixture(scope="module")
def shown() -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(browser, "module", lambda plant, task: b"abc")
        return live.laboratory([FIND]).data


def test_its_settings_begin_as_an_experiment_does(data):
    experiment = Experiment()
    for field in data["fields"]:
        assert field["default"] == getattr(experiment, field["name"])
    assert (data["start"], data["target"]) == (list(paper.START), list(paper.TARGET))
    assert data["layouts"] == json.loads(json.dumps(paper.LAYOUTS))
    assert data["evaluate_every"] == experiment.evaluate_every


def test_whatever_it_allows_an_experiment_takes(data):
    """And what is beyond is refused, but where a page is narrower than the library."""
    for field in data["fields"]:
        name = field["name"]
        if "choices" in field:
            assert all(Experiment(**{name: one}) for one in field["choices"])
            continue
        kind = int if field["whole"] else float
        assert Experiment(**{name: kind(field["least"])})
        assert Experiment(**{name: kind(field["most"])})
        with pytest.raises(ParameterError):
            Experiment(**{name: kind(field["least"]) - 1})
        if name not in training.MOST:
            with pytest.raises(ParameterError):
                Experiment(**{name: kind(field["most"]) * 2})


def test_the_widths_of_the_strips_make_numpys_normal_numbers(data):
    """Within a strip a number is 52 bits times its width, with a sign."""
    widths = data["widths"]
    assert len(widths) == noise.STRIPS
    bits, rng = np.random.default_rng(3), np.random.default_rng(4)
    for _ in range(200):
        strip, negative = rng.choice([0, *range(2, 256)]), rng.integers(2)
        place = int(bits.integers(2**51))
        drawn = noise.drawn(int(strip) | int(negative) << 8 | place << 9)
        assert drawn == (1 - 2 * int(negative)) * place * widths[strip]


def test_the_lesson_sets_theta_c_to_either_side_of_where_the_gap_closes(data):
    runs = [Experiment(**step["settings"]) for step in data["trap"]]
    over = [step["against"] and Experiment(**step["against"]) for step in data["trap"]]
    closed, learned, again, slower, exact, by_hand = runs
    closes = closes_at(learned.task, first_rollout(learned).states[:, :2])
    assert learned.theta[-1] < by_hand.theta[-1] < closes < closed.theta[-1]
    assert over == [
        Experiment(**vars(closed) | {"theta": learned.theta}),
        None,
        None,
        *[learned] * 3,
    ]
    assert (again, exact.learner, slower.alpha) == (learned, "TDC", learned.alpha / 10)
    for one in runs:
        assert (one.layout, one.start, one.seed) == (learned.layout, learned.start, learned.seed)
