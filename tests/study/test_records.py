"""Records: what is written is read, only whole files count, and nothing is unpickled."""

import contextlib
import io
import os
import pickle
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nmpcrl.study import DamagedRecords, Records
from nmpcrl.study.records import LAST, StepStatus, Table, final_cost


def example(rows=40):
    rng = np.random.default_rng(0)
    steps = {
        "episode": np.repeat(np.arange(2), rows // 2),
        "cost": np.where(np.arange(rows) % 7, rng.normal(size=rows), np.nan),
        "theta": rng.normal(size=(rows, 9)),
    }
    evaluations = {"episode": np.array([0, 2]), "cost": np.array([1.5, np.inf])}
    facts = {"stopped": "diverged: “why”", "seconds": 1.25}
    return Records({"learner": "ES", "seed": 3, "theta": [1.0, 0.05]}, steps, evaluations, facts)


def assert_equal(one, other):
    assert one.experiment == other.experiment
    assert one.facts == other.facts
    for table, beside in ((one.steps, other.steps), (one.evaluations, other.evaluations)):
        assert list(table) == list(beside)
        for name in table:
            assert table[name].dtype == beside[name].dtype
            np.testing.assert_array_equal(table[name], beside[name])


@pytest.fixture
def path(tmp_path):
    return tmp_path / "folder" / "run.npz"


def test_what_is_saved_is_loaded(path):
    example().save(path)
    assert_equal(Records.load(path), example())


def test_what_a_run_is_about_can_be_read_alone(path):
    example().save(path)
    assert Records.about(path) == (example().experiment, example().facts)


def test_saving_leaves_nothing_else_behind(path):
    example().save(path)
    assert list(path.parent.iterdir()) == [path]


def test_saving_again_replaces_the_whole_file(path):
    example(rows=400).save(path)
    example(rows=4).save(path)
    assert_equal(Records.load(path), example(rows=4))


def test_nothing_is_pickled(path):
    example().save(path)
    with np.load(path, allow_pickle=False) as file:
        assert all(file[name].dtype != object for name in file.files)


def test_a_run_that_cannot_be_written_leaves_no_file(path, monkeypatch):
    def disk_is_full(file, **arrays):
        file.write(b"half")
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez_compressed", disk_is_full)
    with pytest.raises(OSError, match="no space"):
        example().save(path)
    assert list(path.parent.iterdir()) == []


def test_a_run_that_cannot_be_written_leaves_the_old_one(path, monkeypatch):
    example().save(path)

    def disk_is_full(*_, **__):
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez_compressed", disk_is_full)
    with pytest.raises(OSError, match="no space"):
        example(rows=4).save(path)
    assert_equal(Records.load(path), example())


def test_who_reads_while_a_run_is_replaced_reads_a_whole_one(path):
    """The new file takes the old one's name; the old one's bytes are never written over."""
    example().save(path)
    before = path.read_bytes()
    with path.open("rb") as reader:
        example(rows=400).save(path)
        assert reader.read() == before
    assert path.read_bytes() != before


def test_a_missing_file_is_missing_not_damaged(path):
    with pytest.raises(FileNotFoundError):
        Records.load(path)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.99])
def test_a_file_cut_short_is_damaged(path, share):
    example().save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    for read in (Records.load, Records.about):
        with pytest.raises(DamagedRecords, match=r"run\.npz"):
            read(path)


@pytest.mark.slow
@settings(
    derandomize=True,
    deadline=None,
    max_examples=300,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(place=st.floats(0, 1, exclude_max=True), wrong=st.integers(1, 255))
def test_a_file_with_a_wrong_byte_is_damaged_or_reads_as_some_run(path, place, wrong):
    """Whatever the disk did, reading it raises nothing but `DamagedRecords`."""
    example().save(path)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= wrong
    path.write_bytes(bytes(content))
    with contextlib.suppress(DamagedRecords):
        Records.load(path)


def archive(**members):
    content = io.BytesIO()
    np.savez(content, **members)
    return content.getvalue()


def pickled():
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        file.writestr("about.npy", pickle.dumps({"experiment": {}, "facts": {}}))
    return content.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"hello",
        pickle.dumps({"experiment": {}, "facts": {}}),
        pickled(),
        archive(x=np.arange(3)),
        archive(about=np.array("not json")),
        archive(about=np.array([{"experiment": {}}], dtype=object)),
        archive(about=np.array('{"experiment": {}}')),
    ],
    ids=["text", "pickle", "pickle inside", "no about", "no json", "an object", "no facts"],
)
def test_a_file_of_another_kind_is_damaged_and_never_unpickled(path, content):
    path.parent.mkdir()
    path.write_bytes(content)
    for read in (Records.load, Records.about):
        with pytest.raises(DamagedRecords):
            read(path)


class Trap:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


@pytest.mark.parametrize("name", ["about", "steps/theta"])
def test_no_code_of_a_file_is_run(path, tmp_path, name):
    path.parent.mkdir()
    members = {"about": np.array('{"experiment": {}, "facts": {}}')}
    trap = Trap(tmp_path / "sprung")
    np.savez(path, **members | {name: np.array([trap], dtype=object)})
    with pytest.raises(DamagedRecords):
        Records.load(path)
    assert not trap.folder.exists()


def test_rows_become_columns():
    table = Table([("episode", int), ("theta", float, 3)], capacity=2)
    table.append((0, np.ones(3)))
    table.append((1, np.zeros(3)))
    columns = table.columns()
    assert list(columns) == ["episode", "theta"]
    np.testing.assert_array_equal(columns["episode"], [0, 1])
    np.testing.assert_array_equal(columns["theta"], [[1, 1, 1], [0, 0, 0]])


def test_columns_have_the_rows_that_were_filled_and_are_whole_arrays():
    table = Table([("episode", int), ("states", float, (5, 3))], capacity=1000)
    table.append((7, np.ones((5, 3))))
    columns = table.columns()
    assert columns["episode"].tolist() == [7]
    assert columns["states"].shape == (1, 5, 3)
    assert all(column.flags.c_contiguous and column.base is None for column in columns.values())


def test_what_a_row_does_not_have_is_nan_in_all_of_a_field():
    table = Table([("theta", float, 3)], capacity=1)
    table.append((np.nan,))
    assert np.isnan(table.columns()["theta"]).all()


def test_a_row_of_another_length_is_refused_and_so_is_one_too_many():
    table = Table([("episode", int), ("cost", float)], capacity=1)
    with pytest.raises(ValueError, match="tuple of length 1"):
        table.append((0,))
    table.append((0, 1.0))
    with pytest.raises(IndexError):
        table.append((1, 1.0))


@pytest.mark.parametrize(
    ("cost", "expected"),
    [
        ([9.0, 3.0, 2.0, 1.0], 2.0),
        ([9.0, 5.0, 3.0, 2.0, 1.0], 2.0),
        ([9.0, 2.0, 1.0], 1.5),  # a short run: theta_init's own rollout says nothing of learning
        ([9.0, 1.0], 1.0),
        ([9.0], np.inf),  # stopped before any rollout of a learned theta
        ([9.0, 3.0, np.inf, 1.0], np.inf),
        ([np.inf, 3.0, 2.0, 1.0], 2.0),
    ],
)
def test_the_final_cost_averages_the_last_rollouts_but_never_the_first(cost, expected):
    assert LAST == 3
    assert final_cost(np.array(cost)) == expected


@pytest.mark.parametrize(
    ("failed", "restarts", "status"),
    [(False, 0, StepStatus.SOLVED), (False, 2, StepStatus.RESTARTED), (True, 2, StepStatus.FAILED)],
)
def test_the_status_of_a_step_is_the_worst_of_its_solves(failed, restarts, status):
    assert StepStatus.of(failed=failed, restarts=restarts) is status
