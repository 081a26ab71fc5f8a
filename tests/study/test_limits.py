"""The time that experiments take, and its limit."""

import pytest

from nmpcrl.claims import published
from nmpcrl.study import Experiment, ParameterError, design, limits, sweep
from nmpcrl.study.limits import afford, seconds_of
from nmpcrl.study.published import is_current


def test_the_estimate_of_the_published_study_is_near_what_it_took():
    found = published.load()
    rows = {e: row for e, row in found.rows.items() if is_current("runs", row["variant"])}
    if not rows:
        pytest.skip("every published run is of earlier epochs")
    hours = sum(row["seconds"] for row in rows.values()) / 3600
    assert sum(map(seconds_of, rows)) / 3600 == pytest.approx(hours, rel=0.2)


def refusal(runs, **options) -> str:
    with pytest.raises(ParameterError) as caught:
        afford(runs, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("sure", [False, True])
def test_a_run_that_fills_the_memory_is_refused(sure):
    assert "13,000,000 steps; 4,000,000" in refusal([Experiment(episodes=100_000)], sure=sure)


def test_days_of_training_are_refused_unless_somebody_is_sure(monkeypatch):
    monkeypatch.delenv(limits.SURE, raising=False)
    afford(())
    afford(design.whole_study())
    long = sweep(seed=tuple(range(200)), episodes=20_000, learner=("ES", "RDES"))
    said = refusal(long)
    assert said == refusal(long * 2, sure=False)
    assert said.startswith("400 runs with up to episodes = 20000, steps = 130 and horizon = 10")
    assert said.endswith("24 are allowed, and more with NMPCRL_YES=1 in the environment")
    afford(long, sure=True)
    monkeypatch.setenv(limits.SURE, "1")
    afford(long)
    monkeypatch.setenv(limits.SURE, "0")
    assert refusal(long) == said
