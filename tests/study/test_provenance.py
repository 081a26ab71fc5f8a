"""Keys, the hash of a file's code, the files in the lock, and the machine."""

import json
import subprocess
import sys
from dataclasses import fields, replace

import pytest

from nmpcrl.study import Experiment, machine, paper, provenance
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.provenance import ORIGINAL, changed, code, identity, key, sources, summary_key

MODULE = '''"""A module."""

from collections.abc import Callable

import numpy as np

from nmpcrl.study.paper import ALPHA as RATE
from nmpcrl.study.records import final_cost

__all__ = ["Rule", "step"]


class Rule:
    """A rule."""

    rate: float = RATE  # of learning


def step(theta: float, by: Callable[[float], float]) -> float:
    """A step."""
    return np.abs(theta) - Rule.rate * by(final_cost(theta))
'''
NUMBERS = [
    ("= RATE", "= 2 * RATE"),
    ("np.abs(theta)", "theta"),
    ("Rule.rate * by", "by"),
    ("import ALPHA", "import BETA"),
    ("import final_cost", "import initial_cost as final_cost"),
    ("import numpy as np", "import jax.numpy as np"),
    ("nmpcrl.study.records", "nmpcrl.analysis.metrics"),
    ("rate: float", "rate: int"),
]
NO_NUMBERS = [
    ("A module", "Some module"),
    ("A step.", "One step.\n\n    With a second paragraph.\n    "),
    ("  # of learning", ""),
    ("\n\n\ndef", "\n\n\n# A comment.\n\n\ndef"),
    ("by: Callable[[float], float]", "by: Callable[..., float]"),
    (") -> float:", ") -> object:"),
    ("import Callable", "import Callable, Mapping"),
    ("import numpy as np", "import math\n\nimport numpy as np"),
    ('["Rule", "step"]', '["step"]'),
    ("nmpcrl.study.records", "nmpcrl.study.below.records"),
]


@pytest.mark.parametrize(("before", "after"), [*NUMBERS, *NO_NUMBERS])
def test_an_edit_is_noticed_where_it_can_change_a_number(before, after):
    assert before in MODULE
    edited = MODULE.replace(before, after, 1)
    assert (code(edited) != code(MODULE)) == ((before, after) in NUMBERS)


def test_a_package_that_passes_a_name_on_as_another_counts_and_one_that_does_not_is_empty():
    assert code('"""A package."""\n\nfrom nmpcrl.study.run import run\n\n__all__ = ["run"]\n') == ""
    assert code("from nmpcrl.study.run import run as train\n")


def test_a_moved_file_is_not_changed_and_an_edited_one_is():
    before = {"a.py": "1", "b.py": "2", "c.py": "2"}
    assert changed({"a.py": "1", "b.py": "2", "d/c.py": "2"}, before) == []
    assert changed({"a.py": "3", "b.py": "2", "c.py": "2"}, before) == ["a.py"]
    assert changed({"d/a.py": "3", "b.py": "2", "c.py": "2"}, before) == ["a.py", "d/a.py"]
    assert changed({"a.py": "1", "b.py": "2"}, before) == ["b.py", "c.py"]


WITHOUT_NUMBERS = {  # files that a run imports and that store, lock, describe or start processes
    *("study/jobs.py", "study/provenance.py", "study/store.py", "study/design.py"),
    *("study/files.py", "study/limits.py", "study/machine.py", "study/refusal.py"),
}
IMPORTS = """
import sys
from pathlib import Path
import nmpcrl
from nmpcrl.analysis.search import Search, search
from nmpcrl.analysis.rows import row
from nmpcrl.analysis.summary import summarise
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run

for learner in ("ES", "RDES", "GES"):
    row(summarise(run(Experiment(learner, episodes=1, steps=5, evaluate_every=1))))
search(Search(budget=40))
for module in list(sys.modules.values()):
    if module.__name__.startswith("nmpcrl."):
        print(Path(module.__file__).relative_to(Path(nmpcrl.__file__).parent).as_posix())
"""


def test_every_file_that_a_run_its_summary_and_a_search_import_is_in_the_lock():
    """If a new file bears on no number: add it to `WITHOUT_NUMBERS`, else to `FILES`."""
    made = subprocess.run(
        [sys.executable, "-c", IMPORTS], capture_output=True, text=True, check=True
    )
    imported = {name for name in made.stdout.split() if code((provenance.ROOT / name).read_text())}
    listed = set(sources())
    assert imported - listed - WITHOUT_NUMBERS == set()
    assert {one for one in listed - imported if one.startswith(("study", "analysis"))} == set()
    assert all(any(provenance.ROOT.glob(one)) for one in provenance.FILES)
    assert all((provenance.ROOT / one).exists() for one in provenance.OTHER_HOSTS)


def test_the_code_is_what_the_lock_has():
    """If this fails: `nmpcrl verify --relock`, or raise the epoch of the room and relock."""
    assert changed(sources(), provenance.locked()) == []
    assert json.loads(provenance.LOCK.read_text())["epochs"] == provenance.EPOCHS


@pytest.mark.parametrize("begins", ["07237effb4b1545a", "44134a116cb64ab0"])
def test_runs_of_the_first_edition_are_read(begins):
    """The last two source hashes of that edition."""
    (made,) = (one for one in provenance.locks() if one.startswith(begins))
    assert provenance.is_accepted(made)


def test_an_earlier_lock_is_accepted_until_an_epoch_is_raised(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "LOCK", tmp_path / "lock.json")
    provenance.relock()
    made = provenance.locked_hash()
    for edit in ("first", "second"):
        monkeypatch.setattr(provenance, "sources", lambda edit=edit: {"run.py": edit})
        monkeypatch.setattr(
            provenance, "sources_hash", lambda edit=edit: provenance.hash_of([edit])
        )
        assert provenance.is_accepted(made)
        provenance.relock()
    assert provenance.is_accepted(made)
    assert not provenance.is_accepted(provenance.hash_of(["third"]))
    monkeypatch.setitem(provenance.EPOCHS, "study", 2)
    provenance.relock()
    assert not provenance.is_accepted(made)


def test_a_warning_names_the_changed_files_once(monkeypatch, capsys):
    lock = {**sources(), "learning/updates.py": "another"}
    monkeypatch.setattr(provenance, "locked", lambda: lock)
    monkeypatch.setenv(provenance.WARNED, "")
    for _ in range(2):
        provenance.warn_of_changes.__wrapped__()
    said = capsys.readouterr().err
    assert said.startswith("learning/updates.py: changed since the stored runs were trained")
    assert said.count("\n") == 1


def test_a_key_depends_on_the_fields_that_differ_from_their_original_values():
    assert {*ORIGINAL} == {field.name for field in fields(Experiment)} - {"layout"} | {"obstacles"}
    assert identity(Experiment()) == {}
    for name, value in {
        "seed": 1,
        "alpha": 2e-7,
        "steps": 4,
        "theta": (0.9,) * 9,
        "learner": "DES",
        "solver": "ipopt",
    }.items():
        assert identity(Experiment(**{name: value})) == {name: value}
        assert key(Experiment(**{name: value})) != key(Experiment())
    assert identity(Experiment(layout="B")) == {"obstacles": paper.LAYOUTS["B"]}
    assert key(Experiment()) != summary_key(Experiment())


@pytest.mark.parametrize(
    ("one", "begins"),
    [
        (Experiment(), "9e79cb1f74"),
        (Experiment("RDES", layout="B", seed=7, decay="episode", gated=False), "da885a4823"),
        (Experiment("GES", layout="0.5,2.2 3,0.5", beta=2e-8, box="soft"), "3f1e689524"),
        (Experiment("TDC", beta_tdc=1e-7, horizon=20, solver="fatrop"), "1a87ffe9e9"),
    ],
)
def test_stored_runs_keep_their_keys(monkeypatch, one, begins):
    """The keys in the first epoch, with libraries that are all of version 1."""
    monkeypatch.setattr(provenance, "installed", lambda _: "1")
    monkeypatch.setattr(provenance, "EPOCHS", dict.fromkeys(provenance.EPOCHS, 1))
    assert key(one)[:10] == begins


def test_the_key_does_not_depend_on_how_a_value_was_written():
    assert key(Experiment(alpha=1)) == key(Experiment(alpha=1.0))
    assert key(Experiment(theta=[1] * 9)) == key(Experiment(theta=(1.0,) * 9))


def test_the_centres_of_a_layout_count_and_not_its_letter(monkeypatch):
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
def test_a_version_counts_where_the_library_bears_on_the_numbers(monkeypatch, library):
    for learner in ("ES", "RDES"):
        with monkeypatch.context() as patch:
            keys = {}
            for number in ("1.2", "1.2+cpu", "1.3"):
                other = {library: number}
                patch.setattr(provenance, "installed", lambda name, n=other: n.get(name, "1"))
                keys[number] = key(Experiment(learner))
        assert keys["1.2"] == keys["1.2+cpu"]
        assert (keys["1.2"] != keys["1.3"]) == (library != "torch" or learner == "RDES")


def test_the_machine_is_known_by_what_changes_last_digits(monkeypatch):
    for name in machine.SETTINGS:
        monkeypatch.delenv(name, raising=False)
    common = machine.fingerprint()
    assert "settings" not in common
    monkeypatch.setenv("ATEN_CPU_CAPABILITY", "default")
    assert machine.fingerprint() == common | {"settings": {"ATEN_CPU_CAPABILITY": "default"}}
