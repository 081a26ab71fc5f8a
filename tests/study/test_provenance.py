"""Keys that survive a move, a lock that tells when code has changed, and what a key depends on."""

import json
import shutil
from dataclasses import fields, replace

import pytest

from nmpcrl.study import Experiment, paper, provenance
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.provenance import ORIGINAL, changed, identity, key, sources, summary_key
from nmpcrl.study.storage import machine


@pytest.fixture(scope="module")
def unedited() -> dict[str, str]:
    """The sources as they are."""
    return sources()


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The package in another folder."""
    target = tmp_path_factory.mktemp("copy") / "nmpcrl"
    ignored = shutil.ignore_patterns("*.pyc", "__pycache__")
    return shutil.copytree(provenance.ROOT, target, ignore=ignored)


@pytest.fixture
def edited(copy):
    """The sources of the copy after edits, as `sources` has them; then it is as it was."""
    kept = {}

    def undo():
        for place, text in kept.items():
            if text is None:
                (copy / place).unlink()
            else:
                (copy / place).write_text(text)
        kept.clear()

    def edit(*edits, moved_to=""):
        for place, before, after in edits:
            if place not in kept:
                kept[place] = (copy / place).read_text()
            text = (copy / place).read_text()
            assert before in text
            (copy / place).write_text(text.replace(before, after, 1))
            if moved_to:
                (copy / moved_to).parent.mkdir(exist_ok=True)
                (copy / place).rename(copy / moved_to)
                kept[moved_to] = None
        return sources(copy)

    edit.undo = undo
    yield edit
    undo()


NUMBERS = [
    ("learning/updates.py", "cost + gamma * q_next - q", "cost + gamma * q_next - 2 * q"),
    ("learning/training.py", "PATIENCE = 10", "PATIENCE = 11"),
    ("control/solvers/kernel.py", "ARMIJO = 1e-4", "ARMIJO = 1e-1"),
    ("control/solvers/nlpsol.py", "MAX_ITERATIONS = 300", "MAX_ITERATIONS = 200"),
    ("study/paper.py", "ALPHA = 1e-7", "ALPHA = 1e-6"),
    ("study/setup.py", "spawn(3)", "spawn(4)"),
    ("study/run.py", "evaluate_every == 0", "evaluate_every == 1"),
    ("analysis/metrics.py", "LATE = 20", "LATE = 21"),
    ("analysis/metrics.py", "TOUCH = 1e-6", "TOUCH = 1e-5"),
    ("analysis/imitation.py", "FITS = 4000", "FITS = 4001"),
    ("analysis/policy_search.py", "SPREAD = 0.3", "SPREAD = 0.4"),
    (
        "learning/learners.py",
        "    semi_gradient_step,\n",
        "    auxiliary_step as semi_gradient_step,\n",
    ),
    ("learning/updates.py", "import numpy as np", "import jax.numpy as np"),
    (
        "learning/training.py",
        "from nmpcrl.control.nmpc import ABSURD",
        "from nmpcrl.control.solvers.rows import ABSURD",
    ),
]
NO_NUMBERS = [
    ("learning/updates.py", '"""The update rules', '"""All update rules'),
    ("learning/updates.py", '"""TD error', '"""The TD error'),
    ("learning/updates.py", "\n\n\ndef td_error", "\n\n\n# A comment.\n\n\ndef td_error"),
    ("learning/updates.py", "import numpy as np", "import math\n\nimport numpy as np"),
    ("learning/updates.py", "q_next: float) -> float", "q_next: object) -> object"),
    ("learning/__init__.py", '"td_error",', '"td_error", "another",'),
    ("control/ocp.py", "# z\n", "# the variables\n"),
    ("study/storage/executor.py", "ATTEMPTS = 3", "ATTEMPTS = 4"),
    ("study/departures.py", "A slip of the index.", "A slip of an index."),
    ("claims/rule.py", "MAJORITY = 0.5", "MAJORITY = 0.6"),
]


def test_an_edit_of_what_bears_on_numbers_is_noticed(edited, unedited):
    once = {edit[0]: edit for edit in NUMBERS}  # one edit of each file, and then the others
    for edits in (once.values(), [edit for edit in NUMBERS if edit not in once.values()]):
        assert changed(edited(*edits), unedited) == sorted(edit[0] for edit in edits)
        edited.undo()


def test_such_an_edit_is_noticed_in_a_file_that_was_moved_into_a_subfolder(edited, unedited):
    for place, *edit in (NUMBERS[1], NUMBERS[2]):
        room, _, name = place.partition("/")
        moved_to = f"{room}/below/{name.rpartition('/')[2]}"
        now = edited((place, *edit), moved_to=moved_to)
        assert changed(now, unedited) == sorted([place, moved_to])
        edited.undo()


def test_edits_of_what_bears_on_no_number_are_not(edited, unedited):
    assert changed(edited(*NO_NUMBERS), unedited) == []


def test_a_moved_and_a_renamed_file_change_nothing(edited, unedited):
    now = edited(("learning/updates.py", "", ""), moved_to="learning/below/rules.py")
    assert "learning/below/rules.py" in now
    assert changed(now, unedited) == []


def test_the_code_is_what_the_lock_has():
    """If this fails: `nmpcrl verify --relock`, or raise the epoch of the room and relock."""
    assert changed(sources(), provenance.locked()) == []
    assert json.loads(provenance.LOCK.read_text())["epochs"] == provenance.EPOCHS


def test_who_reads_stored_runs_is_warned_of_other_code(monkeypatch, capsys):
    lock = {**sources(), "learning/updates.py": "another"}
    monkeypatch.setattr(provenance, "locked", lambda: lock)
    monkeypatch.setenv(provenance.WARNED, "")
    provenance.warn_of_changes.__wrapped__()
    provenance.warn_of_changes.__wrapped__()
    said = capsys.readouterr().err
    assert said.startswith("learning/updates.py: changed since the stored runs were trained")
    assert said.count("\n") == 1


def test_every_field_and_nothing_else_has_an_original_value():
    names = {field.name for field in fields(Experiment)}
    assert set(ORIGINAL) == names - {"layout"} | {"obstacles"}


def test_the_papers_run_of_es_is_named_by_versions_and_epochs_alone():
    assert identity(Experiment()) == {}


@pytest.mark.parametrize(
    ("other", "names"),
    [
        ({"seed": 1}, {"seed": 1}),
        ({"alpha": 2e-7}, {"alpha": 2e-7}),
        ({"steps": 4}, {"steps": 4}),
        ({"theta": (0.9,) * 9}, {"theta": (0.9,) * 9}),
        ({"layout": "B"}, {"obstacles": paper.LAYOUTS["B"]}),
        ({"learner": "DES", "gated": False}, {"learner": "DES", "gated": False}),
        ({"solver": "ipopt"}, {"solver": "ipopt"}),
    ],
)
def test_a_key_depends_on_what_differs_from_the_original(other, names):
    assert identity(Experiment(**other)) == names
    assert key(Experiment(**other)) != key(Experiment())


@pytest.mark.parametrize(
    ("fields", "begins"),
    [
        ({}, "9e79cb1f74"),
        (
            {"learner": "RDES", "layout": "B", "seed": 7, "decay": "episode", "gated": False},
            "da885a4823",
        ),
        (
            {"learner": "GES", "layout": "0.5,2.2 3,0.5", "beta": 2e-8, "box": "soft"},
            "3f1e689524",
        ),
        ({"learner": "TDC", "beta_tdc": 1e-7, "horizon": 20, "solver": "fatrop"}, "1a87ffe9e9"),
    ],
)
def test_stored_runs_keep_their_keys(monkeypatch, fields, begins):
    """Those of the first epoch and of libraries that are all of version 1."""
    monkeypatch.setattr(provenance, "installed", lambda _: "1")
    monkeypatch.setattr(provenance, "EPOCHS", dict.fromkeys(provenance.EPOCHS, 1))
    assert key(Experiment(**fields))[:10] == begins


def test_a_run_and_its_summary_have_keys_of_their_own():
    assert key(Experiment()) != summary_key(Experiment())


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
def test_what_a_learner_does_not_read_has_no_part_in_the_key(learner, unread):
    one = Experiment(learner=learner)
    for name, value in unread.items():
        other = replace(one, **{name: value})
        assert key(other) == key(one), name
        assert other.canonical == one


@pytest.mark.parametrize("learner", LEARNERS)
def test_the_frozen_arm_keeps_all_that_is_not_learned(learner):
    one = Experiment(learner=learner, layout="C", seed=3, horizon=5, box="soft", alpha=3e-7)
    assert frozen_arm(one) == Experiment("frozen", layout="C", seed=3, horizon=5, box="soft")


@pytest.mark.parametrize("room", provenance.EPOCHS)
def test_an_epoch_that_is_raised_makes_other_runs(monkeypatch, room):
    before = key(Experiment()), summary_key(Experiment())
    monkeypatch.setitem(provenance.EPOCHS, room, provenance.EPOCHS[room] + 1)
    after = key(Experiment()), summary_key(Experiment())
    assert (before[0] != after[0]) == (room in provenance.RUN_ROOMS)
    assert before[1] != after[1]


@pytest.mark.parametrize("library", ["casadi", "numba", "numpy", "torch"])
@pytest.mark.parametrize("learner", ["ES", "RDES"])
def test_a_version_counts_where_the_library_touches_the_numbers(monkeypatch, library, learner):
    before, version = key(Experiment(learner)), provenance.installed
    other = {library: "0.0.1"}
    monkeypatch.setattr(provenance, "installed", lambda name: other.get(name) or version(name))
    assert (key(Experiment(learner)) != before) == (library != "torch" or learner == "RDES")


def test_what_a_build_adds_to_a_version_does_not_count(monkeypatch):
    monkeypatch.setattr(provenance, "installed", lambda name: "1.2")
    before = key(Experiment("RDES"))
    monkeypatch.setattr(provenance, "installed", lambda name: "1.2+cpu")
    assert key(Experiment("RDES")) == before


def test_what_changes_last_digits_is_part_of_the_machine(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in machine.SETTINGS:
        monkeypatch.delenv(name, raising=False)
    common = machine.fingerprint()
    assert "settings" not in common
    monkeypatch.setenv("ATEN_CPU_CAPABILITY", "default")
    assert machine.fingerprint() == common | {"settings": {"ATEN_CPU_CAPABILITY": "default"}}
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1")
    assert ".numba_config.yaml" in machine.fingerprint()["settings"]
