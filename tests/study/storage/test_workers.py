"""No more workers than there is room for, unless they are asked for twice."""

from functools import partial
from pathlib import Path

import psutil
import pytest

from nmpcrl.analysis import summaries
from nmpcrl.study import Experiment, ParameterError
from nmpcrl.study.provenance import signature
from nmpcrl.study.storage import workers
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.workers import MEMORY, check_workers, free_memory, told, usable_cores


@pytest.fixture
def machine(monkeypatch):
    """A machine of so many cores and so much free memory."""

    def of(cores: int, memory: float) -> None:
        monkeypatch.setattr(workers, "usable_cores", lambda: cores)
        monkeypatch.setattr(workers, "free_memory", lambda: memory)

    return of


def test_by_default_there_are_as_many_workers_as_cores_and_memory_for(machine):
    machine(4, 1e12)
    assert check_workers(None) == 4
    machine(4, 2.5 * MEMORY)
    assert check_workers(None) == 2
    machine(4, 0.0)
    assert check_workers(None) == 1


def test_more_workers_than_cores_are_refused_unless_they_are_asked_for_twice(machine):
    machine(2, 1e12)
    assert check_workers(2) == 2
    with pytest.raises(ParameterError) as refused:
        check_workers(8)
    assert str(refused.value) == (
        "workers = 8 must be at most 2, the number of usable cores: more would only slow each"
        " other down"
    )
    assert check_workers(8, sure=True) == 8


def test_more_workers_than_fit_in_memory_are_refused_unless_they_are_asked_for_twice(machine):
    machine(8, 1e9)
    with pytest.raises(ParameterError) as refused:
        check_workers(4)
    assert str(refused.value) == (
        "workers = 4 must be at most 2: each takes about 450 MB of memory, and 1.0 GB are free"
    )
    assert check_workers(4, sure=True) == 4


@pytest.mark.parametrize("asked", [0, -1, True, 1.0, "2"])
def test_what_is_no_number_of_workers_is_refused_even_if_it_is_asked_for_twice(asked):
    for sure in (False, True):
        with pytest.raises(ParameterError, match="must be a whole number, 1 or more"):
            check_workers(asked, sure=sure)


def test_what_workers_take_is_told_in_a_line_before_they_start(machine, trains_here, capsys):
    machine(2, 7e9)
    execute({name: partial(int, name) for name in "123"}, lambda *_: "")
    first, *_ = capsys.readouterr().err.splitlines()
    assert first == "2 workers, each with about 450 MB of memory; 7.0 GB are free"
    assert told(1) == "1 worker with about 450 MB of memory; 7.0 GB are free"
    execute({"1": partial(int, "1")}, lambda *_: "", progress=False)
    assert not capsys.readouterr().err


@pytest.fixture
def group(tmp_path, monkeypatch) -> Path:
    """A control group within another, as in a container."""
    monkeypatch.setattr(workers, "GROUPS", tmp_path / "groups")
    monkeypatch.setattr(workers, "GROUP", tmp_path / "cgroup")
    (tmp_path / "cgroup").write_text("4:memory:/elsewhere\n0::/pod/container\n")
    place = tmp_path / "groups/pod/container"
    place.mkdir(parents=True)
    return place


def test_a_quota_of_the_control_group_or_of_one_around_it_counts_as_so_many_cores(group):
    free = usable_cores()
    for place in (group, group.parent):
        (place / "cpu.max").write_text("max 100000\n")
        assert usable_cores() == free
        (place / "cpu.max").write_text("50000 100000\n")
        assert usable_cores() == 1
        (place / "cpu.max").unlink()


def test_memory_that_the_control_group_may_still_take_is_free(group):
    assert free_memory() > 1e8
    (group / "memory.max").write_text("100000000\n")
    (group / "memory.stat").write_text("anon 30000000\nfile 60000000\n")
    assert free_memory() == 7e7
    (group / "memory.max").write_text("max\n")
    assert free_memory() > 1e8


def test_no_more_cores_are_used_than_this_process_may(monkeypatch):
    monkeypatch.setattr(workers.os, "sched_getaffinity", lambda _: {3}, raising=False)
    assert usable_cores() == 1


def run_and_measure(learner: str) -> int:
    """What a worker has in memory after a run, as the learner needs it."""
    summaries.make(Experiment(learner=learner, episodes=20), signature(), afresh=True)
    resident: int = psutil.Process().memory_info().rss
    return resident


@pytest.mark.slow
def test_a_worker_takes_as_much_memory_as_is_told():
    taken = {}
    for learner in ("ES", "RDES"):
        jobs = {learner: partial(run_and_measure, learner)}
        failures = execute(jobs, lambda *one: taken.update([one]) or "", workers=1, progress=False)
        assert not failures
    assert 0.5 * MEMORY < max(taken.values()) < 1.2 * MEMORY, taken
