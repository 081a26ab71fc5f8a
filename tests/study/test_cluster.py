"""A study on a Dask cluster: a scheduler and workers of this machine, in processes of their own.

The workers have a folder of runs of their own, as on machines that share no disk.
"""

import ast
import importlib
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summaries import Failed, fetch_summaries
from nmpcrl.analysis.summary import summarise
from nmpcrl.commands import main
from nmpcrl.study import cluster, provenance, run, sweep
from nmpcrl.study.cluster import NoCluster

pytest.importorskip("distributed", reason="needs the extra nmpcrl[cluster]")

TEN = sweep(learner="frozen", seed=tuple(range(10)), episodes=1, steps=2)
PATIENCE = 240.0  # [s]; the machine may be busy

NOTING = """
import os, time
from pathlib import Path

from nmpcrl.analysis import summaries
from nmpcrl.study import run as train

LOG = Path({log!r})
GATE = Path({gate!r})


def run(experiment):
    note("began", experiment)
    if experiment.seed in {killing}:
        os.kill(os.getpid(), 9)
    if f" {{os.getpid()}}\\n" in ended():
        while not GATE.exists():
            time.sleep(0.02)
    records = train(experiment)
    note("ended", experiment)
    return records


def ended():
    return "".join(line for line in LOG.open() if line.startswith("ended"))


def note(what, experiment):
    with LOG.open("a") as log:
        log.write(f"{{what}} {{experiment.seed}} {{os.getpid()}}\\n")


summaries.run = run
"""
MISTAKEN = """
from nmpcrl.analysis import summaries


def run(experiment):
    raise ArithmeticError("a mistake")


summaries.run = run
"""
OTHER_VERSIONS = """
from nmpcrl.study import provenance

provenance.LIBRARIES = provenance.LIBRARIES[1:]
"""
NOTING_REFUSALS = """
from pathlib import Path

from nmpcrl.analysis import summaries


def noting(signature=summaries.signature):
    with Path({log!r}).open("a") as log:
        log.write("refused 0 0\\n")
    return signature()


summaries.signature = noting
"""
WITHOUT_PACKAGE = """
import sys

sys.modules["nmpcrl"] = None
"""


@pytest.fixture(autouse=True)
def runs(tmp_path, monkeypatch) -> Path:
    """A folder of this test's own."""
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    return tmp_path / "runs"


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    """Start a part of Dask; all that were started end with the module."""
    started = []
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    variables = {
        "NMPCRL_RUNS": str(elsewhere / "runs"),
        "OMP_NUM_THREADS": "1",
        "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",  # as book/cluster.md has it
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",  # Dask's own 3 take as much longer
    }

    def start(*arguments: str) -> subprocess.Popen:
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        with (elsewhere / f"{len(started)}.log").open("w") as log:
            started.append(
                subprocess.Popen(
                    command, cwd=elsewhere, env=os.environ | variables, stdout=log, stderr=log
                )
            )
        return started[-1]

    start.elsewhere = elsewhere
    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def address(dask) -> str:
    """Of a scheduler without workers."""
    file = dask.elsewhere / "scheduler.json"
    dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
    wait_until(file.exists)
    return json.loads(file.read_text())["address"]


@pytest.fixture
def worker(dask, address, tmp_path):
    """Start a worker that first executes a text; it ends with the test."""
    started = []

    def start(text: str = "", *options: str) -> subprocess.Popen:
        name = f"worker{len(started)}"
        preload = tmp_path / f"{name}.py"
        preload.write_text(text)
        common = ("--nthreads", "1", "--no-nanny", "--name", f"{tmp_path.name}-{name}")
        started.append(dask("worker", address, *common, "--preload", str(preload), *options))
        return started[-1]

    yield start
    for process in started:
        process.terminate()
    for process in started:
        process.wait(timeout=PATIENCE)


@pytest.fixture
def log(tmp_path) -> Path:
    (tmp_path / "log").touch()
    return tmp_path / "log"


@pytest.fixture
def gate(log) -> Path:
    """Until this file is there, a worker stays at its second run."""
    return log.with_name("gate")


def noting(log: Path, *, killing: tuple[int, ...] = ()) -> str:
    """What lets a worker note what it does; the runs of some seeds kill it."""
    return NOTING.format(log=str(log), gate=str(log.with_name("gate")), killing=killing)


@contextmanager
def meanwhile(act: Callable[[], None], gate: Path) -> Iterator[None]:
    """Act beside what is done here; then, or if that fails, the workers go on."""
    failed: list[BaseException] = []

    def then_open():
        try:
            act()
        except BaseException as error:
            failed.append(error)
        finally:
            gate.touch()

    helper = threading.Thread(target=then_open)
    helper.start()
    try:
        yield
    finally:
        helper.join()
    assert not failed, failed


def noted(log: Path) -> list[tuple[str, int, int]]:
    lines = [line.split() for line in log.read_text().splitlines()]
    return [(what, int(seed), int(pid)) for what, seed, pid in lines]


def seeds(log: Path, what: str) -> list[int]:
    return sorted(seed for said, seed, _ in noted(log) if said == what)


def wait_until(holds):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, "this was waited for in vain"
        time.sleep(0.02)


def on_cluster(address, experiments, **options):
    with cluster.executor(address, patience=PATIENCE) as executor:
        return fetch_summaries(experiments, executor=executor, progress=False, **options)


@pytest.mark.slow
def test_a_cluster_trains_what_this_machine_would_train_and_needs_no_shared_disk(
    address, worker, dask, runs
):
    worker()
    experiments = sweep(learner=("RDES", "GES"), episodes=2, steps=65)
    study = on_cluster(address, experiments)
    for experiment in experiments:
        ours, theirs = summarise(run(experiment)), study[experiment]
        for name in set(ours.episodes) - {"seconds"}:
            np.testing.assert_array_equal(theirs.episodes[name], ours.episodes[name])
    assert {path.parent.name for path in runs.rglob("*.npz")} == {"summaries"}
    assert not (dask.elsewhere / "runs").exists()


@pytest.mark.slow
def test_a_killed_worker_loses_nothing_and_what_is_stored_is_not_run_again(
    address, worker, log, gate
):
    six = TEN[:6]
    pair = [worker(noting(log)), worker(noting(log))]
    stored: list[int] = []

    def kill_one_at_work():
        wait_until(lambda: victims(log))
        pid, _ = victims(log)[0]
        stored.extend(seed for seed in range(6) if summaries.is_stored(TEN[seed]))
        os.kill(pid, signal.SIGKILL)

    with meanwhile(kill_one_at_work, gate):
        study = on_cluster(address, six)
    assert list(study) == list(six)
    began = seeds(log, "began")
    assert set(began) == set(range(6))
    assert len(began) > 6  # what the worker was at is begun again ...
    assert stored
    assert all(began.count(seed) == 1 for seed in stored)  # ... and nothing that is stored
    assert sorted(process.poll() is None for process in pair) == [False, True]


def victims(log: Path) -> list[tuple[int, int]]:
    """Workers that are at a run and have had others, all of which are stored: id and seed."""
    last = {pid: (what, seed) for what, seed, pid in noted(log)}
    ended = {pid: [seed for w, seed, p in noted(log) if (w, p) == ("ended", pid)] for pid in last}
    return [
        (pid, seed)
        for pid, (what, seed) in last.items()
        if what == "began" and ended[pid] and all(summaries.is_stored(TEN[e]) for e in ended[pid])
    ]


@pytest.mark.slow
def test_a_run_that_kills_every_worker_fails_and_the_others_end(address, worker, log, gate):
    """Dask gives it up after `distributed.scheduler.allowed-failures`; nannies replace workers."""
    gate.touch()
    worker(noting(log, killing=(1,)), "--nanny")
    with pytest.raises(Failed, match="1 of 3 runs failed"):
        on_cluster(address, TEN[:3])
    assert [summaries.is_stored(e) for e in TEN[:3]] == [True, False, True]
    assert seeds(log, "began").count(1) == 2


@pytest.mark.slow
def test_a_run_that_fails_on_a_worker_is_told_with_its_reason(address, worker):
    worker(MISTAKEN)
    with pytest.raises(Failed, match="ArithmeticError: a mistake"):
        on_cluster(address, TEN[:1])


@pytest.mark.slow
def test_a_worker_that_joins_while_others_train_trains_too(address, worker, log, gate):
    worker(noting(log))

    def join_late():
        wait_until(lambda: seeds(log, "began"))
        worker(noting(log))
        wait_until(lambda: len({pid for _, _, pid in noted(log)}) == 2)

    with meanwhile(join_late, gate):
        on_cluster(address, TEN)
    assert len({pid for what, _, pid in noted(log) if what == "ended"}) == 2
    assert seeds(log, "ended") == list(range(10))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "reason"),
    [(OTHER_VERSIONS, "other versions"), (WITHOUT_PACKAGE, "cannot say which code it has")],
    ids=["other versions", "no package"],
)
def test_workers_that_would_make_other_numbers_are_refused_in_a_sentence(
    address, worker, text, reason
):
    worker(text)
    with pytest.raises(NoCluster, match=reason) as refused:
        on_cluster(address, TEN)
    assert "\n" not in str(refused.value)
    assert not any(map(summaries.is_stored, TEN))


@pytest.mark.slow
def test_a_worker_with_other_versions_that_joins_late_trains_nothing(address, worker, log, gate):
    worker(noting(log))

    def join_late():
        wait_until(lambda: seeds(log, "began"))
        worker(OTHER_VERSIONS + NOTING_REFUSALS.format(log=str(log)))
        wait_until(lambda: seeds(log, "refused"))

    with meanwhile(join_late, gate):
        study = on_cluster(address, TEN, strict=False)
    assert 0 < len(study) < len(TEN)
    for found in study.values():
        assert found.facts["versions"] == provenance.environment()
    assert seeds(log, "ended") == sorted(e.seed for e in study)


@pytest.mark.slow
def test_a_scheduler_without_workers_is_refused_in_a_sentence(address):
    with (
        pytest.raises(NoCluster, match=f"the scheduler at {address} has no worker"),
        cluster.executor(address, patience=1),
    ):
        pass


def test_an_address_where_no_scheduler_is_is_refused_in_a_sentence():
    with (
        pytest.raises(NoCluster, match=r"no scheduler answers at tcp://127[.]0[.]0[.]1:9"),
        cluster.executor("tcp://127.0.0.1:9", patience=1),
    ):
        pass


def test_without_dask_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(NoCluster, match=r"pip install 'nmpcrl\[cluster\]'"),
        cluster.executor("tcp://127.0.0.1:9"),
    ):
        pass


PAGE = (Path(__file__).resolve().parents[2] / "book/cluster.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("text", blocks("python"), ids=["SLURM", "Kubernetes"])
def test_the_programs_of_the_page_import_what_there_is(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("nmpcrl"):
            module = importlib.import_module(node.module)
            for alias in node.names:
                if not hasattr(module, alias.name):
                    importlib.import_module(f"{node.module}.{alias.name}")


@pytest.mark.slow
def test_the_commands_of_the_page_have_the_options_they_are_given():
    lines = "".join(blocks("bash")).replace("\\\n", "").splitlines()
    commands = [shlex.split(line) for line in lines]
    ours = [words[1:] for words in commands if words[0] == "nmpcrl"]
    assert len(ours) == 2
    for name, *options in ours:
        main.commands[name].make_context(name, options)  # refuses what it does not know
    for words in commands:
        if words[0] == "dask":
            shown = subprocess.run(
                [sys.executable, "-m", "dask", words[1], "--help"],
                capture_output=True,
                text=True,
                check=True,
            )
            assert all(word in shown.stdout for word in words if word.startswith("--"))
