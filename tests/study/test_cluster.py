"""A study on a Dask cluster: a scheduler and workers of this machine, in processes of their own.

The workers have a folder of runs of their own, as on machines that share no disk.
"""

import ast
import contextlib
import importlib
import json
import os
import re
import shlex
import shutil
import signal
import socket
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


PAGE = (Path(__file__).resolve().parents[2] / "book/cluster.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)


def page_commands() -> list[list[str]]:
    lines = "".join(blocks("bash")).replace("\\\n", "").splitlines()
    return [shlex.split(line) for line in lines]


(WHOLE,) = blocks("toml")
pytestmark = pytest.mark.usefixtures("runs")


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

    def start(*arguments: str, cwd: Path = elsewhere) -> subprocess.Popen:
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        with (elsewhere / f"{len(started)}.log").open("w") as log:
            started.append(
                subprocess.Popen(
                    command, cwd=cwd, env=os.environ | variables, stdout=log, stderr=log
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


@pytest.mark.weekly
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
@pytest.mark.parametrize(
    ("text", "reason"),
    [(OTHER_VERSIONS, "other versions"), (WITHOUT_PACKAGE, "cannot report which code it has")],
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


@pytest.mark.weekly
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


@pytest.fixture
def threads() -> Iterator[None]:
    """What is refused leaves no thread behind: Dask's may keep a process from its end."""
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) <= before


def refusal(address: str, **options) -> str:
    """The one sentence in which a cluster is refused, however much patience there is."""
    with pytest.raises(NoCluster) as refused, cluster.executor(address, patience=3600, **options):
        pass
    assert "\n" not in str(refused.value)
    return str(refused.value)


@pytest.mark.usefixtures("threads")
@pytest.mark.parametrize(
    "address",
    ["", "foo", "foo:x", "foo:0", "foo:99999", "tcp://foo", "tcp://:8786", "http://foo:80"]
    + ["tcp://foo:8786/bar", "tcp://me@foo:8786", "tcp://foo:8786?bar", "[::1:8786"],
)
def test_an_address_that_is_none_is_refused_before_anybody_is_asked(address):
    assert refusal(address) == (
        f"the scheduler's address {address!r} must be HOST:PORT, tcp://HOST:PORT or tls://HOST:PORT"
    )


@pytest.mark.usefixtures("threads")
@pytest.mark.parametrize("host", ["127.0.0.1:9", "[::1]:9", "nowhere.invalid:8786"])
def test_where_nobody_listens_nobody_is_waited_for(host):
    for address in (host, f"tcp://{host}"):
        assert refusal(address).startswith(f"no scheduler answers at tcp://{host}: ")


SAYS = {"nothing": b"", "something else": b"SSH-2.0-OpenSSH_9.2\r\n" * 9, "that it ends": None}


@pytest.mark.usefixtures("threads")
@pytest.mark.parametrize("says", SAYS.values(), ids=SAYS)
def test_who_is_no_scheduler_is_not_waited_for(says, monkeypatch):
    monkeypatch.setattr(cluster, "ANSWER", 0.3)
    with listening(says) as address:
        said = refusal(address)
    assert said.startswith(f"{address} does not answer like a Dask scheduler")


@contextmanager
def listening(says: bytes | None) -> Iterator[str]:
    """Somebody who takes every connection, and says this or closes it."""
    taken: list[socket.socket] = []

    def take():
        with contextlib.suppress(OSError):
            while True:
                taken.append(server.accept()[0])
                if says is None:
                    taken[-1].close()
                else:
                    taken[-1].sendall(says)

    server = socket.create_server(("127.0.0.1", 0))
    thread = threading.Thread(target=take)
    thread.start()
    try:
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
    finally:
        server.shutdown(socket.SHUT_RDWR)
        thread.join()
        for one in (server, *taken):
            one.close()


@pytest.fixture(scope="module")
def certificate(tmp_path_factory) -> Path:
    """Make the page's certificate and security file, and say where that is."""
    if not shutil.which("openssl"):
        pytest.skip("needs openssl")
    folder = tmp_path_factory.mktemp("tls")
    (making,) = [text for text in blocks("bash") if "openssl" in text]
    subprocess.run(["bash", "-ec", making], cwd=folder, check=True, capture_output=True)
    (folder / "tls.toml").write_text(WHOLE)
    return folder / "tls.toml"


def test_the_key_of_the_page_is_for_its_owner_alone(certificate):
    assert certificate.with_name("key.pem").stat().st_mode & 0o777 == 0o600


FILES = {
    "tls-ca-file = ": "is not TOML",
    "": "each a path; it names nothing",
    'ca = "cert.pem"': "must name tls-ca-file, tls-client-cert, tls-client-key",
    WHOLE.replace('"key.pem"', "7"): "each a path",
    WHOLE.replace("key.pem", "none.pem"): "names tls-client-key = 'none.pem': no such file",
    WHOLE.replace("key.pem", "."): "names tls-client-key = '.': no such file",
    WHOLE.replace("key.pem", "cert.pem"): "cannot be used",
    WHOLE.replace("cert.pem", "key.pem"): "cannot be used",
    WHOLE.replace("key.pem", "locked.pem"): "must not have a passphrase",
}


@pytest.mark.parametrize(("text", "sentence"), FILES.items(), ids=range(len(FILES)))
def test_a_security_file_that_is_none_is_refused_before_anybody_is_asked(
    certificate, text, sentence
):
    file = certificate.with_name("other.toml")
    file.write_text(text)
    certificate.with_name("locked.pem").write_text("-----BEGIN ENCRYPTED PRIVATE KEY-----\n")
    assert sentence in refusal("tls://127.0.0.1:9", security=file)


def test_an_address_goes_with_certificates_if_it_says_so(certificate):
    at = "127.0.0.1:9"
    assert "cannot be read: No such file" in refusal(at, security=certificate.with_name("none"))
    assert "needs a security file" in refusal(f"tls://{at}")
    assert "tls:// needs one" in refusal(f"tcp://{at}", security=certificate)
    assert f"no scheduler answers at tls://{at}" in refusal(at, security=certificate)


@pytest.mark.weekly
@pytest.mark.slow
def test_only_who_has_the_key_of_a_cluster_is_let_in(certificate, dask, tmp_path, monkeypatch):
    """With the commands of the page, except for the port."""
    file = certificate.with_name("scheduler.json")
    scheduler, worker = [line[1:] for line in page_commands() if line[0] == "dask"]
    scheduler[scheduler.index("--port") + 1] = "0"
    dask(*scheduler, "--scheduler-file", str(file), cwd=certificate.parent)
    wait_until(file.exists)
    address = json.loads(file.read_text())["address"]
    assert address.startswith("tls://")
    worker[worker.index("tls://127.0.0.1:8786")] = address
    dask(*worker, cwd=certificate.parent)
    with cluster.executor(address, security=certificate, patience=PATIENCE) as executor:
        study = fetch_summaries(TEN[:2], executor=executor, progress=False)
    assert set(study) == set(TEN[:2])

    monkeypatch.setattr(cluster, "ANSWER", 2.0)
    assert "or needs certificates" in refusal(address.replace("tls", "tcp"))
    (making,) = [text for text in blocks("bash") if "openssl" in text]
    subprocess.run(["bash", "-ec", making], cwd=tmp_path, check=True, capture_output=True)
    (tmp_path / "tls.toml").write_text(WHOLE)
    assert "or refuses these certificates" in refusal(address, security=tmp_path / "tls.toml")


def test_without_dask_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(NoCluster, match=r"pip install 'nmpcrl\[cluster\]'"),
        cluster.executor("tcp://127.0.0.1:9"),
    ):
        pass


@pytest.mark.parametrize("text", blocks("python"), ids=["SLURM", "Kubernetes"])
def test_the_programs_of_the_page_import_what_there_is(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("nmpcrl"):
            module = importlib.import_module(node.module)
            for alias in node.names:
                if not hasattr(module, alias.name):
                    importlib.import_module(f"{node.module}.{alias.name}")


def test_the_commands_of_the_page_have_the_options_they_are_given():
    ours = [words[1:] for words in page_commands() if words[0] == "nmpcrl"]
    assert len(ours) == 2
    for name, *options in ours:
        main.commands[name].make_context(name, options)  # refuses what it does not know
