"""Runs made here against published ones: bits, ranges, verdicts, and the proof for a new lock."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from builders import evidence_of as made_up
from builders import scaled, timings

from nmpcrl.analysis import summaries
from nmpcrl.claims.published import Evidence, Published
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome, Verdict
from nmpcrl.studies import reproduce
from nmpcrl.studies.reproduce import compare, contradictions, of_runs, of_times, relock
from nmpcrl.study import Experiment, design, lock, provenance, sweep
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.refusal import Refusal

HERE = {"machine": fingerprint(), "versions": provenance.environment()}
ELSEWHERE = HERE | {"machine": fingerprint() | {"processor": "another"}}


def published_of(found, made=HERE) -> Published:
    """Summaries as if they had been published."""
    runs = Evidence().joined(found, dict.fromkeys(found, design.MAIN_TABLE)).runs
    about = {"batches": [made | {"runs": {design.MAIN_TABLE: len(runs)}}]}
    return Published(found, runs, about=about)


def with_part(known: Published, experiment: Experiment, part: str) -> Published:
    """The same, with one run in another part."""
    here = known.runs.variant.where([e != experiment for e in known.summaries], part)
    return replace(known, runs=known.runs.assign(variant=here))


@pytest.fixture
def study():
    """A small main table; a function of the final costs of four runs of ES over the first cost."""

    def make(*costs):
        ends = {Experiment(seed=k): {"end": cost} for k, cost in enumerate(costs)}
        return dict(made_up(lambda e: ends.get(e, {}), layouts=("A",)).summaries)

    return make


def moved(one):
    theta = one.episodes["theta"] + np.spacing(1.0)
    return replace(one, episodes=one.episodes | {"theta": theta})


@pytest.mark.parametrize("edit", [lambda one: scaled(one, 1 + 1e-15, -1), moved])
def test_on_the_same_machine_the_last_bit_counts(study, edit):
    found, first = study(), Experiment(seed=2)
    known = published_of(found)
    assert compare(found, known).empty
    wrong = compare(found | {first: edit(found[first])}, known)
    assert wrong[["learner", "layout", "decay", "seed"]].values.tolist() == [["ES", "A", "step", 2]]


@pytest.mark.parametrize("other", ["machine", "versions", "key"])
def test_elsewhere_the_last_bit_does_not_count(study, other):
    found = study()
    known = published_of(found, HERE | ({} if other == "key" else {other: {"python": "2.7"}}))
    if other == "key":
        known = replace(known, runs=known.runs.assign(key="0"))
    assert compare({e: scaled(one, 1 + 1e-9) for e, one in found.items()}, known).empty


FAILED = (np.inf,) * 4


@pytest.mark.parametrize(
    ("there", "here", "count", "contradicts"),
    [
        ((0.6, 0.7, 0.8, 0.9), (0.4, 1.1, 0.7, 0.8), 4, False),  # within the widened range
        ((0.6, 0.7, 0.8, 0.9), (5.0, 0.7, 0.8, 0.9), 4, False),  # one of four far outside
        ((0.6, 0.7, 0.8, 0.9), (5.0, 5.0, 5.0, 0.9), 4, True),
        ((0.6, 0.7, 0.8, 0.9), (0.1, 0.1, 0.1, 0.1), 4, True),
        ((0.6, 0.7, 0.8, 0.9), FAILED, 3, True),
        ((0.6, 0.7, 0.8, 0.9), FAILED, 2, False),  # too few runs
        ((0.6, 0.7, np.inf, np.inf), FAILED, 4, False),  # published runs failed, too
        (FAILED, (0.6, 0.7, 0.8, 0.9), 4, False),
    ],
)
def test_elsewhere_most_runs_must_lie_in_the_published_range(
    study, there, here, count, contradicts
):
    made, mine = study(*here), [Experiment(seed=k) for k in range(count)]
    wrong = compare({e: made[e] for e in mine}, published_of(study(*there), ELSEWHERE))
    assert wrong.what.tolist() == ["final_cost"] * contradicts


def test_elsewhere_the_cost_of_theta_init_must_agree_and_here_a_batch_is_comparable(study):
    found, other = study(), Experiment(horizon=5)
    edited = {Experiment(): scaled(found[Experiment()], 1 + 1e-4, 0)}
    assert compare(edited, published_of(found, ELSEWHERE)).what.tolist() == ["initial_cost"]
    assert compare({other: found[Experiment()]}, published_of(found)).empty
    variant = scaled(replace(found[Experiment()], experiment=asdict(other)), 2.0)
    arm = {frozen_arm(other): found[frozen_arm(Experiment())]}
    known = published_of(found | {other: variant} | arm, ELSEWHERE)
    assert compare({other: variant}, known).empty
    as_main = replace(found[Experiment()], experiment=asdict(other))
    assert "initial_cost" in set(compare({other: as_main}, known).what)
    known = published_of(study(), ELSEWHERE)
    more, *rest = known.rows
    known = with_part(known, more, "alpha x 3")
    batches = (*known.batches, HERE | {"runs": {"alpha x 3": 1}})
    added = replace(known, about={"batches": batches})
    assert reproduce.comparable([more, *rest], known) == set()
    assert reproduce.comparable([more, *rest, Experiment(seed=99)], added) == {more}


def verdict(outcome: Outcome, interval: tuple[float, float] | None = None) -> Verdict:
    share = None if interval is None else sum(interval) / 2
    return Verdict("C1", "It works.", outcome, "", share, interval)


@pytest.mark.parametrize(
    ("here", "there", "contradict"),
    [
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(NOT, (0.0, 0.2)), True),
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(PARTLY, (0.3, 0.7)), True),
        (verdict(REPRODUCED, (0.8, 1.0)), verdict(PARTLY, (0.3, 0.81)), False),
        (verdict(PARTLY, (0.1, 0.2)), verdict(PARTLY, (0.6, 0.7)), False),
        (verdict(UNDECIDABLE, (0.9, 1.0)), verdict(NOT, (0.0, 0.2)), False),
        (verdict(REPRODUCED), verdict(NOT), True),
        (replace(verdict(REPRODUCED), claim="C9"), verdict(NOT), False),
    ],
)
def test_two_decided_verdicts_contradict_each_other_beyond_chance_alone(here, there, contradict):
    assert contradictions([here], [there]) == ((here, there),) * contradict
    assert contradictions([there], [here]) == ((there, here),) * contradict


@pytest.mark.parametrize(
    ("ratio", "waited", "made", "contradicted"),
    [
        (0.5, 0.0, HERE, ["C3"]),
        (0.7, 0.0, HERE, []),
        (0.5, 0.9, HERE, []),  # a busy machine
        (0.6, 0.3, HERE, []),  # its interval reaches across a border
        (0.5, 0.0, ELSEWHERE, []),
    ],
)
def test_times_contradict_published_ones_of_this_machine(ratio, waited, made, contradicted):
    known = Published(timings=timings(0.65, width=0.01), timed=made)
    found = of_times(timings(ratio, width=0.01, waited=waited), known)
    assert [here.claim for here, _ in found] == contradicted


def diverges(experiment):
    """C1 is reproduced: DES is stopped and RDES is not."""
    return {"reached": 40, "training": np.inf} if experiment.learner == "DES" else {}


def test_verdicts_on_runs_are_compared_in_the_same_layouts_and_readings():
    known, found = published_of(made_up().summaries), made_up(diverges).summaries
    pairs = of_runs(found, known)
    assert [here.claim for here, _ in pairs] == ["C1", "W9"]
    assert [(here.outcome, there.outcome) for here, there in pairs[:1]] == [(REPRODUCED, NOT)]
    assert of_runs(made_up(diverges, layouts=("B",)).summaries, known) == ()
    assert of_runs(made_up(diverges, episodes=50).summaries, known) == ()
    assert of_runs({replace(e, horizon=5): one for e, one in found.items()}, known) == ()


SHORT = {"episodes": 2, "steps": 3, "evaluate_every": 1}
MAIN = sweep(learner=("ES", "GES"), seed=(0, 1, 2), **SHORT)
OTHER = sweep(learner="ES", horizon=5, seed=(0, 1), **SHORT)
PARTS = dict.fromkeys(MAIN, "main") | dict.fromkeys(OTHER, "N = 5")
KNOWN = Published(dict.fromkeys(PARTS), pd.DataFrame({"variant": PARTS.values()}))


def test_a_sample_is_spread_over_parts_and_learners():
    assert reproduce.sample(PARTS, 2) == (MAIN[0], OTHER[0])
    four = reproduce.sample(PARTS, 4)
    assert {PARTS[e] for e in four[:2]} == {PARTS[e] for e in four[2:]} == {"main", "N = 5"}
    assert {e.learner for e in four if PARTS[e] == "main"} == {"ES", "GES"}
    assert set(reproduce.sample(PARTS, 99)) == set(PARTS)


@pytest.fixture
def locked(tmp_path, monkeypatch):
    """Runs and a lock of this test; the lock is of the code as it is."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setattr(lock, "LOCK", tmp_path / "sources.lock.json")

    here = lambda train, runs, *_: [(e, train(e)) for e in runs]  # noqa: E731
    monkeypatch.setattr(reproduce, "parallel", here)  # in this process, which is patched
    return lock.relock()


def edit(monkeypatch, times=1.0, code="edited"):
    """From here on the code is other code, whose runs have costs times a factor."""
    real = summaries.summarise
    monkeypatch.setattr(lock, "sources", lambda: {"learning/updates.py": code})
    monkeypatch.setattr(lock, "sources_hash", lambda: provenance.hash_of([code]))
    monkeypatch.setattr(summaries, "summarise", lambda records: scaled(real(records), times))


def train_here():
    with ThreadPoolExecutor(1) as executor:
        summaries.fetch_summaries(reproduce.sample(PARTS, 4), executor=executor, progress=False)


def test_the_lock_is_written_where_no_bit_has_changed(locked, monkeypatch):
    train_here()
    edit(monkeypatch)
    assert relock(KNOWN, 4)[1:] == (0, 4)
    assert json.loads(locked.read_text())["sources"] == {"learning/updates.py": "edited"}
    edit(monkeypatch, code="edited again")
    assert relock(KNOWN, 4)[1:] == (0, 4)  # runs of the first relock are compared with


def test_the_lock_is_written_where_an_epoch_was_raised(locked, monkeypatch):
    edit(monkeypatch, times=2.0)
    monkeypatch.setitem(provenance.EPOCHS, "learning", 99)
    assert relock(KNOWN, 4)[1:] == (0, 0)
    found = json.loads(locked.read_text())
    assert (found["epochs"]["learning"], found["earlier"]) == (99, [])


@pytest.mark.parametrize(
    ("stored", "times", "refusal"),
    [
        (True, 1 + 1e-15, "4 of 4 runs have other bits, first ES .*final_cost"),
        (False, 1.0, "only 0 of 4 runs .* `nmpcrl verify --sample 4`"),
    ],
)
def test_otherwise_the_lock_stays(locked, monkeypatch, stored, times, refusal):
    before = locked.read_text()
    if stored:
        train_here()
    edit(monkeypatch, times)
    if not stored:
        train_here()  # by code that is not locked
    with pytest.raises(Refusal, match=refusal):
        relock(KNOWN, 4)
    assert locked.read_text() == before
