"""The page's program on a real SLURM: one node of this machine, from one file in a folder of the
test's own, with two jobs, one of which is cancelled at work."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import psutil
import pytest

from nmpcrl.analysis import summaries
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import run, sweep

pytestmark = pytest.mark.slurm

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scancel", "squeue", "openssl", "bash")
PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
PATIENCE = 150.0  # [s]; the machine may be busy
RUNS = sweep(learner=("ES", "frozen"), seed=(0, 1, 2), episodes=2, steps=65)
PAGE = (Path(__file__).resolve().parents[2] / "book/cluster.md").read_text()
SMALLER = {  # what the page's program says, and what it says here
    "cores=16, processes=16": "cores=1, processes=1",
    'memory="16GB"': 'memory="1GB"',
    "jobs=8": "jobs=2",
    "design.whole_study()": (
        'sweep(learner=("ES", "frozen"), seed=(0, 1, 2), episodes=2, steps=65)'
    ),
    "import cluster, design": "import cluster, sweep",
}
CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=0
KillWait=2
MpiDefault=none
ReturnToService=2
NodeName=node NodeHostname={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000
PartitionName=all Nodes=node Default=YES State=UP
"""
NOTING = """
import os, time
from pathlib import Path

from nmpcrl.analysis import summaries
from nmpcrl.study import run as train

FOLDER = Path({folder!r})
JOB = os.environ["SLURM_JOB_ID"]


def run(experiment):
    note("began", experiment)
    if f"ended {{JOB}} " in (FOLDER / "log").read_text():
        while not (FOLDER / "gate").exists():  # its second run waits until a job is cancelled
            time.sleep(0.02)
    records = train(experiment)
    note("ended", experiment)
    return records


def note(what, experiment):
    with (FOLDER / "log").open("a") as log:
        log.write(f"{{what}} {{JOB}} {{experiment.learner}} {{experiment.seed}}\\n")


summaries.run = run
"""


def missing(reason: str) -> None:
    """Skip the test; where it must be made, fail."""
    if os.environ.get("NMPCRL_REQUIRE_SLURM"):
        pytest.fail(f"{reason}, and NMPCRL_REQUIRE_SLURM is set")
    pytest.skip(reason)


@pytest.fixture
def slurm() -> Iterator[dict[str, str]]:
    """A cluster of one node with two cores; the environment in which its commands find it."""
    if not sys.platform.startswith("linux"):
        missing("SLURM is for Linux")
    lacking = [name for name in PROGRAMS if not shutil.which(name, path=PATH)]
    if lacking:
        missing(f"SLURM is not installed, or not whole: there is no {', '.join(lacking)}")
    if os.getuid():
        missing("only root can start SLURM for a test")
    if not find_spec("dask_jobqueue"):
        missing("dask-jobqueue is not installed: pip install 'nmpcrl[cluster]'")
    with ExitStack() as stack:
        place = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="slurm-")))
        place.chmod(0o755)  # munged wants it open, as pytest's own folders are not
        environment = os.environ | {"PATH": PATH, "SLURM_CONF": str(configured(place))}
        for command in daemons(place):
            stack.enter_context(daemon(command, environment))
        try:
            wait_until(lambda: "idle" in said("sinfo", "-h", "-o", "%t", env=environment))
            yield environment
        finally:
            said("scancel", "--user=root", env=environment)
            wait_until(lambda: not said("squeue", "-h", env=environment))
    assert not [one for one in psutil.process_iter() if str(place) in " ".join(words(one))]


def configured(place: Path) -> Path:
    """The file from which all parts of the cluster are told what it is."""
    for name in ("state", "spool"):
        (place / name).mkdir()
    host = socket.gethostname().partition(".")[0]
    text = CONFIGURATION.format(host=host, ports=free_ports(2), folder=place)
    (place / "slurm.conf").write_text(text)
    return place / "slurm.conf"


def daemons(place: Path) -> Iterator[list[str]]:
    """The commands that start a cluster, each of which needs the one before."""
    key = place / "munge.key"
    key.touch(mode=0o600)
    key.write_bytes(os.urandom(128))
    names = {"key-file": "munge.key", "socket": "munge.socket", "pid-file": "munge.pid"}
    names |= {"seed-file": "munge.seed"}
    yield ["munged", "--foreground", *(f"--{name}={place / it}" for name, it in names.items())]
    wait_until((place / "munge.socket").exists)
    yield ["slurmctld", "-D", "-c", "-f", str(place / "slurm.conf")]
    yield ["slurmd", "-D", "-c", "-N", "node", "-f", str(place / "slurm.conf")]


@contextmanager
def daemon(command: list[str], environment: dict[str, str]) -> Iterator[None]:
    """A part of the cluster, which ends with the test."""
    place = Path(environment["SLURM_CONF"]).parent
    program = shutil.which(command[0], path=PATH)
    with (place / f"{command[0]}.out").open("w") as log:
        process = subprocess.Popen(
            [str(program), *command[1:]], env=environment, cwd=place, stdout=log, stderr=log
        )
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def free_ports(count: int) -> list[int]:
    """Ports of the loopback that nobody has."""
    with ExitStack() as stack:
        taken = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(count)]
        return [one.getsockname()[1] for one in taken]


def words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def said(*command: str, env: dict[str, str]) -> str:
    answered = subprocess.run(command, env=env, capture_output=True, text=True, timeout=60)
    return answered.stdout


def wait_until(holds: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, "this was waited for in vain"
        time.sleep(0.1)


def block(language: str, word: str) -> str:
    """The one block of the page in this language that has this word."""
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)
    (found,) = [text for text in blocks if word in text]
    return found


@pytest.fixture
def script(slurm, tmp_path, monkeypatch) -> Callable[[], subprocess.Popen]:
    """Start the page's program, made smaller, where its workers note what they do."""
    program = block("python", "SLURMCluster")
    for before, after in SMALLER.items():
        assert program.count(before) == 1
        program = program.replace(before, after)
    (tmp_path / "script.py").write_text(program)
    (tmp_path / "tls.toml").write_text(block("toml", "tls-ca-file"))
    subprocess.run(
        ["bash", "-ec", block("bash", "openssl")], cwd=tmp_path, check=True, capture_output=True
    )
    (tmp_path / "noting.py").write_text(NOTING.format(folder=str(tmp_path)))
    (tmp_path / "log").touch()
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    environment = slurm | {
        "NMPCRL_RUNS": str(tmp_path / "runs"),
        "DASK_JOBQUEUE__SLURM__INTERFACE": "lo",
        "DASK_JOBQUEUE__SLURM__LOCAL_DIRECTORY": str(tmp_path),
        "DASK_DISTRIBUTED__WORKER__PRELOAD": json.dumps([str(tmp_path / "noting.py")]),
    }

    def start() -> subprocess.Popen:
        with (tmp_path / "script.out").open("a") as log:
            return subprocess.Popen(
                [sys.executable, "script.py"], cwd=tmp_path, env=environment, stdout=log, stderr=log
            )

    return start


def noted(folder: Path) -> list[tuple[str, str, str]]:
    """What began and ended, in which job, and which run it was."""
    lines = [line.split(maxsplit=2) for line in (folder / "log").read_text().splitlines()]
    return [(what, job, name) for what, job, name in lines]


def at_work(folder: Path) -> set[str]:
    """The jobs that are at a run and have had another."""
    ended = {job for what, job, _ in noted(folder) if what == "ended"}
    last = {job: what for what, job, _ in noted(folder)}
    return {job for job in ended if last[job] == "began"}


def stored() -> dict[str, int]:
    """When each run was stored that is."""
    return {
        f"{e.learner} {e.seed}": summaries.path_of(e).stat().st_mtime_ns
        for e in RUNS
        if summaries.is_stored(e)
    }


def test_a_job_of_the_pages_program_is_cancelled_and_nothing_is_lost(slurm, script, tmp_path):
    program = script()
    try:
        wait_until(lambda: len(at_work(tmp_path)) == 2 or program.poll() is not None)
        wait_until(lambda: len(stored()) == 2)
        before, cancelled = stored(), min(at_work(tmp_path))
        said("scancel", cancelled, env=slurm)
        wait_until(lambda: cancelled not in said("squeue", "-h", "-o", "%i", env=slurm).split())
        (tmp_path / "gate").touch()
        assert program.wait(timeout=PATIENCE) == 0, (tmp_path / "script.out").read_text()
    finally:
        program.kill()
        program.wait()
    after = stored()
    assert len(after) == len(RUNS)  # nothing is lost,
    began = [name for what, _, name in noted(tmp_path) if what == "began"]
    assert set(began) == set(after)
    assert len(began) == len(RUNS) + 1  # what the job was at is begun again,
    assert {name: after[name] for name in before} == before  # and nothing that was stored;
    for experiment in RUNS:  # each has the bits that it has here
        ours, theirs = summarise(run(experiment)), summaries.load(experiment)
        for name in set(ours.episodes) - {"seconds"}:
            np.testing.assert_array_equal(theirs.episodes[name], ours.episodes[name])
    wait_until(lambda: not said("squeue", "-h", env=slurm))  # the program has ended its jobs

    assert script().wait(timeout=PATIENCE) == 0  # and once more,
    assert stored() == after
    assert len([what for what, *_ in noted(tmp_path) if what == "began"]) == len(began)
