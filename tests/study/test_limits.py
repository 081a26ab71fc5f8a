"""What experiments will take: near what the published ones took, and refused above a limit."""

from collections import defaultdict

import pytest

from nmpcrl.claims import published
from nmpcrl.study import Experiment, ParameterError, design, limits, sweep
from nmpcrl.study.limits import estimate, memory_of, seconds_of


def test_nothing_takes_nothing():
    assert estimate(()) == limits.Estimate()
    estimate(()).refuse()


def test_the_estimate_of_the_published_study_is_near_what_it_took():
    found = published.load()
    hours = sum(batch["hours"] for batch in found.batches)
    assert estimate(found.rows).seconds / 3600 == pytest.approx(hours, rel=0.2)
    each = defaultdict(list)
    for experiment, row in found.rows.items():
        each[experiment.learner, experiment.horizon].append(row["seconds"] / seconds_of(experiment))
    for kind, ratios in each.items():
        assert 0.4 < sum(ratios) / len(ratios) < 2, kind


def test_the_whole_study_may_begin():
    estimate(design.whole_study()).refuse(sure=False)


def test_a_run_named_twice_counts_once():
    assert estimate([Experiment()] * 3) == estimate([Experiment()])


@pytest.mark.parametrize(
    "longer",
    [
        {"episodes": 600},
        {"steps": 260},
        {"horizon": 20},
        {"learner": "GES", "constrained": True},
        {"learner": "RDES"},
        {"learner": "RDES", "network": "four fits"},
        {"solver": "ipopt"},
        {"evaluate_every": 1},
    ],
)
def test_what_is_longer_takes_longer(longer):
    assert seconds_of(Experiment(**longer)) > seconds_of(Experiment())


def test_every_fit_of_a_network_takes_its_time():
    one, four = (Experiment("RDES", network=network) for network in ("plain", "four fits"))
    fits = 3 * one.episodes * one.steps
    assert seconds_of(four) - seconds_of(one) == pytest.approx(fits * limits.FIT)


def refusal(runs, **options) -> str:
    with pytest.raises(ParameterError) as caught:
        estimate(runs).refuse(**options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_run_that_takes_too_much_memory_is_refused_whoever_is_sure():
    large = Experiment(episodes=100_000)
    assert memory_of(large) > limits.MEMORY
    for sure in (False, True):
        assert refusal([Experiment(), large], sure=sure) == (
            "a run with episodes = 100000, steps = 130 and horizon = 10 takes about 12.3 GB of"
            " memory; 4 GB are allowed"
        )


def test_runs_that_take_days_are_refused_unless_somebody_is_sure(monkeypatch):
    long = sweep(seed=tuple(range(100)), episodes=20_000, learner=("ES", "RDES"))
    said = refusal(long)
    assert said == refusal(long, sure=False)
    assert said.startswith("200 runs, the longest with episodes = 20000, steps = 130 and horizon")
    assert said.endswith("24 are allowed, and more with NMPCRL_YES=1 in the environment")
    assert refusal(long, lift="--yes").endswith("more with --yes")
    estimate(long).refuse(sure=True)
    monkeypatch.setenv(limits.SURE, "1")
    estimate(long).refuse()
    monkeypatch.setenv(limits.SURE, "0")
    assert refusal(long) == said
