"""What a command cannot do ends in one sentence, before any work and without a traceback."""

import errno
import shlex
from pathlib import Path

import numpy as np
import pytest
from builders import raising

from nmpcrl.claims.published import Damaged
from nmpcrl.commands.refusals import INSTEAD, sentence
from nmpcrl.study import Experiment, StoreError, fetch

TRAIN, STUDY = "train --episodes 1 --steps 4 ", "investigate main_study "
REFUSALS = [  # what is typed, and what the refusal names
    ("nonsense", "No such command 'nonsense'"),
    *((name, instead) for name, instead in INSTEAD.items()),
    (TRAIN + "--learner SARSA", "learner = 'SARSA' must be one of ES, DES"),
    (TRAIN + "--alpha -1", "alpha = -1.0 must be a number in (0, 1e+06]"),
    (TRAIN + "--seed x", "'x' is not a valid int"),
    (TRAIN + "--theta 1,x", "'1,x' is not a list of numbers"),
    ("train --episodes 10000 --horizon 500 --solver ipopt", "and more with NMPCRL_YES=1"),
    ("runs --sort costs", "'costs' is not one of 'run'"),
    ("show nobody", "no run begins with 'nobody'; stored: ES-A-step-seed0-2ep-"),
    ("show ES", "2 runs begin with 'ES'; stored: ES-A-step-seed0-2ep-"),
    ("show damaged", "damaged.npz is damaged, or not a run"),
    ("show GES --out a.pdf", "'a.pdf' must end in .svg or .png"),
    ("show GES --out nowhere/a.svg", "'nowhere/a.svg' cannot be written"),
    (STUDY + "--part mian", "part = 'mian' must be one of main, controls"),
    ("investigate nowhere", "'nowhere' must be one of main_study, agents"),
    ("suite", "--policy names an entry"),
    ("suite --policy ES --layouts 41 --moving", "layouts = 41 must be a whole number from 1 to 40"),
    (STUDY + "--workers 0", "0 is not in the range x>=1"),
    ("verify", "nothing is published in "),
    ("wasm --plant robot", "as MODULE:NAME would"),
    ("wasm --plant nowhere_at_all:robot", "No module named"),
    ("wasm --plant nmpcrl.study:paper", "is no Plant"),
    ("wasm --problem a:b --task c:d", "a Problem has no Plant and no Task beside it"),
    ("wasm --out /nowhere/at/all.wasm", "cannot be written"),
    ("grade nowhere --out a.csv", "'nowhere' does not exist"),
]


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> Path:
    """A folder of three short runs and a damaged file."""
    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NMPCRL_RUNS", str(folder))
        for learner, seed in (("ES", 0), ("ES", 1), ("GES", 0)):
            fetch(Experiment(learner, seed, episodes=2, steps=4))
    (folder / "damaged.npz").write_text("not a run")
    return folder


@pytest.mark.parametrize(("line", "said"), REFUSALS, ids=[line for line, _ in REFUSALS])
def test_a_refusal_names_the_value_and_what_is_allowed(
    command, runs, tmp_path, monkeypatch, line, said
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NMPCRL_RUNS", str(runs))
    for work in ("nmpcrl.study.fetch", "nmpcrl.analysis.summaries.fetch_summaries"):
        monkeypatch.setattr(work, raising(AssertionError("work has begun")))
    monkeypatch.setattr("nmpcrl.learning.browser.module", raising(AssertionError("work has begun")))
    before = sorted(runs.iterdir())
    assert said in refused(command(*shlex.split(line)))
    assert sorted(runs.iterdir()) == before
    assert not list(tmp_path.iterdir())


def refused(ended) -> str:
    """The one sentence of a command that was refused."""
    assert ended.exit_code in (1, 2), ended.output
    assert isinstance(ended.exception, SystemExit), ended.exception
    (said,) = [one for one in ended.stderr.splitlines() if one.startswith("Error: ")]
    return said


@pytest.mark.parametrize("line", [STUDY + "--dry-run", "runs", "investigate worlds --dry-run"])
def test_a_file_in_the_place_of_the_folder_of_runs(command, tmp_path, line):
    (tmp_path / "runs").write_text("")
    said = refused(command(*line.split()))
    assert f"NMPCRL_RUNS = {str(tmp_path / 'runs')!r} must be a folder" in said


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (Damaged("one sentence"), "one sentence"),
        (StoreError("one sentence"), "one sentence"),
        (OSError(errno.ENOSPC, "No space left on device", "x"), "x: No space left on device"),
        (MemoryError(), "this machine has too little memory"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), ""),
        (np.linalg.LinAlgError("singular"), ""),
    ],
)
def test_a_known_error_is_a_sentence_and_a_mistake_of_the_library_a_traceback(error, said):
    assert sentence(error) == said
