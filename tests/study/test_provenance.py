"""Keys and epochs of runs, and the machine."""

from dataclasses import replace

import pytest

from nmpcrl.study import Experiment, machine, paper, provenance
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.provenance import identity, key, summary_key


def test_a_key_depends_on_fields_that_differ_from_their_originals_and_on_centres(monkeypatch):
    assert identity(Experiment()) == {}
    for name, value in {"seed": 1, "alpha": 2e-7, "theta": (0.9,) * 9, "solver": "ipopt"}.items():
        assert identity(Experiment(**{name: value})) == {name: value}
        assert key(Experiment(**{name: value})) != key(Experiment())
    assert identity(Experiment("RDES", gated=False)) == {"learner": "RDES", "gated": False}
    assert identity(Experiment(layout="B")) == {"obstacles": paper.LAYOUTS["B"]}
    assert key(Experiment()) != summary_key(Experiment())
    before = key(Experiment(layout="A")), key(Experiment(layout="B"))
    monkeypatch.setitem(paper.LAYOUTS, "Z", paper.LAYOUTS["B"])
    assert key(Experiment(layout="Z")) == before[1]
    monkeypatch.setitem(paper.LAYOUTS, "A", ((0.0, 0.0), *paper.LAYOUTS["A"][1:]))
    assert key(Experiment(layout="A")) not in before


@pytest.mark.parametrize(
    ("learner", "unread"),
    [
        ("ES", {"zeta": 0.5, "beta": 1e-3, "network": "tanh", "gated": False, "curvature": False}),
        ("GES", {"zeta": 0.5, "beta_tdc": 1.0, "projected": False}),
        ("DES", {"beta": 1e-3, "beta_tdc": 1.0}),
        ("QL", {"constrained": True}),
        ("frozen", {"alpha": 1.0, "beta": 1.0, "ties_active": True, "constrained": True}),
    ],
)
def test_fields_that_a_learner_does_not_read_have_no_part_in_the_key(learner, unread):
    one = Experiment(learner=learner)
    for name, value in unread.items():
        other = replace(one, **{name: value})
        assert key(other) == key(one), name
        assert other.canonical == one


@pytest.mark.parametrize("learner", LEARNERS)
def test_the_frozen_arm_has_every_field_that_no_learner_reads(learner):
    one = Experiment(learner=learner, layout="C", seed=3, horizon=5, box="soft", alpha=3e-7)
    assert frozen_arm(one) == Experiment("frozen", layout="C", seed=3, horizon=5, box="soft")


@pytest.mark.parametrize("room", provenance.EPOCHS)
def test_a_raised_epoch_makes_other_runs(monkeypatch, room):
    before = key(Experiment()), summary_key(Experiment())
    monkeypatch.setitem(provenance.EPOCHS, room, provenance.EPOCHS[room] + 1)
    after = key(Experiment()), summary_key(Experiment())
    assert (before[0] != after[0]) == (room in provenance.RUN_ROOMS)
    assert before[1] != after[1]


@pytest.mark.parametrize("library", ["casadi", "numba", "numpy", "torch"])
@pytest.mark.parametrize("learner", ["ES", "RDES"])
def test_a_version_counts_where_the_library_bears_on_the_numbers(monkeypatch, library, learner):
    keys = []
    for number in ("1.2", "1.2+cpu", "1.3"):
        other = {library: number}
        monkeypatch.setattr(provenance, "installed", lambda name, n=other: n.get(name, "1"))
        keys.append(key(Experiment(learner)))
    assert keys[0] == keys[1]
    assert (keys[0] != keys[2]) == (library != "torch" or learner == "RDES")


def test_the_machine_is_known_by_what_changes_last_digits(monkeypatch):
    for name in machine.SETTINGS:
        monkeypatch.delenv(name, raising=False)
    common = machine.fingerprint()
    assert "settings" not in common
    monkeypatch.setenv("ATEN_CPU_CAPABILITY", "default")
    assert machine.fingerprint() == common | {"settings": {"ATEN_CPU_CAPABILITY": "default"}}
