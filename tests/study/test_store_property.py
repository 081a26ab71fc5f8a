"""Whatever happens to a store: it gives no wrong number, and no finished run is lost or repeated.

A machine writes, reads and damages runs, kills a process between any two calls of the system, lets
two processes ask at once, and fills the disk; after each step every file is checked. Training is a
stand-in that takes microseconds and notes that it took place.
"""

import os
import resource
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest
from builders import assert_same_numbers, made_records
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from nmpcrl.study import (
    DamagedRecords,
    Experiment,
    Records,
    StoreError,
    fetch,
    fetch_all,
    store,
    stored,
)
from nmpcrl.study.store import RUNS

EXPERIMENTS = tuple(
    Experiment(learner, seed=seed, episodes=2, steps=3, evaluate_every=1)
    for learner, seed in (("ES", 0), ("ES", 1), ("frozen", 0))
)
SYSTEM = {"posix", "fcntl", "io", "_io"}  # the modules whose functions call it
MEMORY = Path("/dev/shm")  # where nobody waits for a disk
each = st.sampled_from(EXPERIMENTS)


def trained(experiment: Experiment, **_) -> Records:
    """What training gives; it is noted in a file, for it may be another process that trains."""
    with (Path(os.environ["NMPCRL_RUNS"]).parent / "trained").open("a") as log:
        log.write(f"{EXPERIMENTS.index(experiment)}\n")
    return truth(experiment)


def truth(experiment: Experiment) -> Records:
    return made_records(experiment, 6, EXPERIMENTS.index(experiment) + 1)


def in_a_fork(do: Callable[[], object]) -> Callable[[], int]:
    """Do something in another process; what is returned waits for its end and gives its code."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # this process may have threads
        child = os.fork()
    if child:
        return lambda: os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    try:
        with Path(os.devnull).open("w") as sys.stderr:
            do()
    except BaseException:
        (Path(os.environ["NMPCRL_RUNS"]).parent / "wrong").write_text(traceback.format_exc())
        os._exit(1)
    os._exit(0)


def kill_before(call: int) -> None:
    """From here on, this process ends without another word before so many calls of the system."""
    left = call

    def watch(_, event, function):
        nonlocal left
        if event == "c_call":
            owner = type(getattr(function, "__self__", None)).__module__
            if function.__module__ in SYSTEM or owner in SYSTEM:
                left -= 1
                if left < 0:
                    os._exit(9)

    sys.setprofile(watch)


def ask(*experiments: Experiment) -> None:
    """The runs asked for are as they should be; also in another process."""
    if len(experiments) == 1:
        found = {experiments[0]: fetch(experiments[0])}
    else:
        with ThreadPoolExecutor(2) as two:
            found = fetch_all(experiments, executor=two, progress=False)
    assert list(found) == list(experiments)
    for e in experiments:
        assert_same_numbers(found[e], truth(e))


class Machine(RuleBasedStateMachine):
    """What is stored of each experiment, as far as it is known from what was done to it."""

    def __init__(self) -> None:
        super().__init__()
        self.root = Path(tempfile.mkdtemp(dir=MEMORY if MEMORY.is_dir() else None))
        self.patch = pytest.MonkeyPatch()
        self.patch.setenv("NMPCRL_RUNS", str(self.root / "runs"))
        self.patch.setenv("NMPCRL_WARNED", "1")
        self.patch.setattr(store, "compile_ahead", lambda _: None)
        self.patch.setattr(store, "run", trained)
        (self.root / "trained").touch()
        self.whole: set[Experiment] = set()  # is stored, and must not be trained again
        self.doubtful: set[Experiment] = set()  # something is there, and may be whole

    def teardown(self) -> None:
        self.patch.undo()
        shutil.rmtree(self.root)

    def times(self, experiment: Experiment) -> int:
        log = (self.root / "trained").read_text().split()
        return log.count(str(EXPERIMENTS.index(experiment)))

    @rule(experiments=st.lists(each, min_size=1, unique=True))
    def read_or_write(self, experiments) -> None:
        before = {e: self.times(e) for e in experiments}
        ask(*experiments)
        for e in experiments:
            again = self.times(e) - before[e]
            assert again <= 1
            assert again == 0 or e not in self.whole
            assert again == 1 or e in self.whole | self.doubtful
            self.whole.add(e)
            self.doubtful.discard(e)

    @rule(
        experiment=each,
        how=st.sampled_from(["garble", "cut", "empty", "gone", "text"]),
        place=st.floats(0, 1, exclude_max=True),
        wrong=st.integers(1, 255),
    )
    def damage(self, experiment, how, place, wrong) -> None:
        path = RUNS.path_of(experiment)
        content = bytearray(path.read_bytes() if path.is_file() else b"")
        if not content:
            return
        at = int(place * len(content))
        cut, content[at] = content[:at], content[at] ^ wrong
        if how == "gone":
            path.unlink()
        else:
            path.write_bytes({"garble": content, "cut": cut, "empty": b"", "text": b"hello"}[how])
        self.whole.discard(experiment)
        self.doubtful |= {experiment} if how == "garble" else set()

    @rule(one=each, other=each)
    def mistake(self, one, other) -> None:
        if one != other and {one, other} <= self.whole:
            shutil.copy(RUNS.path_of(one), RUNS.path_of(other))
            self.whole.remove(other)

    @rule(experiment=each, call=st.integers(0, 400))
    def kill(self, experiment, call) -> None:
        before, there = self.times(experiment), RUNS.path_of(experiment).exists()
        code = in_a_fork(lambda: (kill_before(call), ask(experiment)))()
        assert code in (0, 9), (self.root / "wrong").read_text()
        assert experiment not in self.whole or self.times(experiment) == before
        if code == 0:
            self.whole.add(experiment)
        self.look_after(experiment, there)

    @rule(experiments=st.lists(each, min_size=1, unique=True))
    def ask_in_two_processes(self, experiments) -> None:
        before = {e: self.times(e) for e in experiments}
        missing = {e for e in experiments if e not in self.whole}
        both = [in_a_fork(lambda: ask(*experiments)) for _ in range(2)]
        codes = [end() for end in both]
        assert codes == [0, 0], (self.root / "wrong").read_text()
        for e in experiments:
            assert self.times(e) - before[e] <= (e in missing)
        self.whole |= set(experiments)
        self.doubtful -= set(experiments)

    @rule(experiment=each, room=st.integers(1000, 20_000))
    def ask_where_the_disk_is_full(self, experiment, room) -> None:
        def fill_and_ask() -> None:
            self.patch.setattr(store, "check_folder", lambda: None)  # it fills up later
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
            with suppress(StoreError):
                ask(experiment)
            resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)

        there = RUNS.path_of(experiment).exists()
        assert in_a_fork(fill_and_ask)() == 0, (self.root / "wrong").read_text()
        self.look_after(experiment, there)

    def look_after(self, experiment: Experiment, there: bool) -> None:
        """Writing may have been broken off: a new file is complete, an old one may be replaced."""
        if experiment not in self.whole and RUNS.path_of(experiment).exists():
            (self.doubtful if there else self.whole).add(experiment)

    @invariant()
    def every_file_is_the_truth_or_says_that_it_is_damaged(self) -> None:
        for experiment in EXPERIMENTS:
            try:
                found = Records.load(RUNS.path_of(experiment))
            except (FileNotFoundError, DamagedRecords):
                assert experiment not in self.whole
                continue
            assert_same_numbers(found, truth(Experiment(**found.experiment)))

    @invariant()
    def the_list_of_runs_is_the_truth(self) -> None:
        for fields, facts in stored().values():
            assert facts["final_cost"] == truth(Experiment(**fields)).facts["final_cost"]


Machine.TestCase.settings = settings(
    max_examples=15,
    stateful_step_count=12,
    derandomize=True,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork"),
]
TestRuns = Machine.TestCase
