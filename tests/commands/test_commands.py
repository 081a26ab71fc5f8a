"""The command `nmpcrl`, used as a user would, on runs of a few short episodes."""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from raising import raising

from nmpcrl.analysis import summaries
from nmpcrl.analysis.policy_search import LEAST, Search
from nmpcrl.claims import publish, published, rule
from nmpcrl.claims.verdict import Verdict
from nmpcrl.commands import main
from nmpcrl.study import Experiment, cluster, design, limits, paper, sweep
from nmpcrl.study.design import FIELDS
from nmpcrl.study.learners import LEARNERS

WHOLE = len(design.whole_study())
SHORT = {"episodes": 4, "steps": 5, "evaluate_every": 2}
STUDY = {
    **dict.fromkeys(sweep(learner=("ES", "frozen"), seed=(0, 1), **SHORT), "main"),
    **dict.fromkeys(sweep(learner=("ES", "frozen"), horizon=5, **SHORT), "N = 5"),
}


@pytest.fixture
def small(monkeypatch, measured):
    """A study of six short runs, short searches, judged by nobody, and times nobody measured."""
    times = pd.DataFrame(measured["learners"])
    monkeypatch.setattr(design, "whole_study", lambda: dict(STUDY))
    monkeypatch.setattr(publish, "Search", partial(Search, budget=LEAST))
    monkeypatch.setattr(publish, "rejudge", lambda: ())
    monkeypatch.setattr(publish, "time_learners_repeatedly", lambda: times)


@pytest.fixture
def trained(command, small):
    """The small study, trained in this process."""
    with ThreadPoolExecutor(1) as one:
        return summaries.fetch_summaries(STUDY, executor=one, progress=False)


def name_of_the_stored_run(tmp_path):
    (path,) = (tmp_path / "runs").glob("*.npz")
    return path.stem


def test_train_stores_a_run_that_runs_lists_and_evaluate_judges(command, tmp_path):
    trained = command("train", "--learner", "GES", "--episodes", "1", "--seed", "3")
    assert trained.exit_code == 0, trained.output
    name = name_of_the_stored_run(tmp_path)
    assert f"{name}.npz: finished" in trained.output
    listed = command("runs").output.splitlines()
    assert listed[0].split()[:6] == ["run", "learner", "layout", "decay", "seed", "episodes"]
    assert listed[1].split()[:6] == [name, "GES", "A", "step", "3", "1"]
    judged = command("evaluate", name)
    assert judged.exit_code == 0
    assert "noise-free cost" in judged.output
    assert "theta " in judged.output


def test_training_again_reads_the_stored_run(command, tmp_path, monkeypatch):
    assert command("train", "--learner", "frozen", "--episodes", "1").exit_code == 0

    monkeypatch.setattr(
        "nmpcrl.study.store.run", raising(AssertionError("the run was trained a second time"))
    )
    again = command("train", "--learner", "frozen", "--episodes", "1")
    assert again.exit_code == 0, again.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--learner", "SARSA"), f"learner = 'SARSA' must be one of {', '.join(LEARNERS)}"),
        (("--episodes", "0"), "episodes = 0 must be a whole number from 1 to 100000"),
        (("--layout", "Z"), f"layout = 'Z' must be {FIELDS['layout'].text}"),
        (("--alpha", "-1"), "alpha = -1.0 must be a number in (0, 1e+06]"),
        (("--decay", "k"), "decay = 'k' must be one of step, episode"),
    ],
)
def test_train_refuses_what_it_cannot_do_in_one_sentence(command, tmp_path, words, sentence):
    refused = command("train", *words)
    assert refused.exit_code == 1
    assert refused.output.strip() == f"Error: {sentence}"
    assert not (tmp_path / "runs").exists()


def test_evaluate_names_the_runs_there_are_when_asked_for_another(command, tmp_path):
    command("train", "--learner", "frozen", "--episodes", "1")
    refused = command("evaluate", "nope")
    assert refused.exit_code == 1
    assert name_of_the_stored_run(tmp_path) in refused.output


def test_a_damaged_file_is_named_and_left_alone(command, tmp_path):
    (tmp_path / "runs").mkdir()
    damaged = tmp_path / "runs" / "damaged.npz"
    damaged.write_text("not a run")
    assert f"{damaged} is damaged, or not a run" in command("runs").output
    refused = command("evaluate", "damaged")
    assert refused.exit_code == 1
    assert "is damaged, or not a run" in refused.output
    assert damaged.exists()


def test_a_dry_run_says_how_much_is_to_be_done_and_does_nothing(command, small, tmp_path):
    said = command("study", "--dry-run")
    assert said.exit_code == 0, said.output
    assert "0 of 6 runs are stored" in said.output
    assert " s of one core" in said.output
    assert not (tmp_path / "runs").exists()


@pytest.mark.slow
def test_study_trains_what_is_missing(command, small):
    asked = command("study", "--workers", "2")
    assert asked.exit_code == 0, asked.output
    assert all(map(summaries.is_stored, STUDY))
    done = command("study", "--dry-run").output
    assert "6 of 6 runs are stored" in done
    assert "take about" not in done


def test_study_trains_a_part_of_itself(command, small, trains_here):
    asked = command("study", "--part", "N = 5", "--workers", "1")
    assert asked.exit_code == 0, asked.output
    assert {STUDY[e] for e in STUDY if summaries.is_stored(e)} == {"N = 5"}


def test_the_whole_study_takes_hours(command):
    said = command("study", "--dry-run").output
    assert f"0 of {WHOLE:,} runs are stored" in said
    hours, unit, *_ = said.split("take about ")[1].split()
    assert 1 < float(hours) < 24
    assert unit == "h"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--part", "mian"), "there is no part 'mian'; the parts are main, N = 5"),
        (("--scheduler", "tcp://nowhere:1"), "no scheduler answers at tcp://nowhere:1"),
    ],
)
def test_study_refuses_what_it_cannot_do_in_one_sentence(
    command, small, monkeypatch, words, sentence
):
    monkeypatch.setattr(cluster, "executor", partial(cluster.executor, patience=1))
    refused = command("study", *words)
    assert refused.exit_code == 1
    assert f"Error: {sentence}" in refused.output


def test_a_run_that_fails_is_told_and_the_others_are_kept(
    command, trained, trains_here, monkeypatch
):
    (path,) = [summaries.path_of(e) for e in STUDY if e.learner == "ES" and e.seed == 1]
    path.unlink()

    def fail(experiment):
        raise ArithmeticError("a mistake")

    monkeypatch.setattr(summaries, "run", fail)
    told = command("study")
    assert told.exit_code == 1
    assert "1 of 6 runs failed" in told.output
    assert "ArithmeticError: a mistake" in told.output


def test_the_table_of_episodes_tells_every_run_from_every_other(command, trained, tmp_path):
    asked = command("study", "--table", str(tmp_path / "episodes.csv.gz"))
    assert asked.exit_code == 0, asked.output
    frame = pd.read_csv(tmp_path / "episodes.csv.gz")
    assert len(frame) == len(STUDY) * SHORT["episodes"]
    names = ["variant", "learner", "layout", "decay", "seed", "episode"]
    assert not frame.duplicated(names).any()
    for experiment, one in trained.items():
        mine = frame[
            (frame.variant == STUDY[experiment])
            & (frame.learner == experiment.learner)
            & (frame.seed == experiment.seed)
        ]
        np.testing.assert_allclose(mine.cost, one.episodes["cost"], rtol=1e-6)


@pytest.mark.slow
def test_the_table_of_the_whole_study_takes_100_megabytes_at_most(command, trained, tmp_path):
    """Every number as noisy as can be, in runs of full length."""
    rng, shape = np.random.default_rng(0), (paper.EPISODES,)
    noisy = {}
    for seed in range(20):
        experiment = Experiment(seed=seed)
        one = next(iter(trained.values()))
        episodes = {
            name: rng.normal(size=shape + column.shape[1:])
            if column.dtype.kind == "f"
            else rng.integers(0, 130, size=shape + column.shape[1:])
            for name, column in one.episodes.items()
        }
        fields = one.experiment | {"seed": seed, "episodes": paper.EPISODES}
        noisy[experiment] = replace(one, experiment=fields, episodes=episodes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(design, "whole_study", lambda: dict.fromkeys(noisy, "main"))
        patch.setattr(summaries, "is_stored", lambda _: True)
        patch.setattr(summaries, "fetch_summaries", lambda *_, **__: noisy)
        asked = command("study", "--table", str(tmp_path / "episodes.csv.gz"))
    assert asked.exit_code == 0, asked.output
    size = (tmp_path / "episodes.csv.gz").stat().st_size
    assert size / len(noisy) * WHOLE < 100e6


@pytest.mark.slow
def test_what_is_published_verifies_the_runs_it_was_made_of(command, trained):
    asked = command("study", "--publish")
    assert asked.exit_code == 0, asked.output
    assert list(published.load().rows) == list(STUDY)
    assert list(published.load().searches) == [Search(a, budget=LEAST) for a in design.LAYOUTS]
    verified = command("verify")
    assert verified.exit_code == 0, verified.output
    assert "6 runs compared with the published ones, 6 bit for bit: " in verified.output
    assert ": 0 contradictions" in verified.output


def test_verify_names_what_contradicts_and_fails(command, trained, trains_here):
    command("study", "--publish")
    wrong = next(e for e in STUDY if e.learner == "ES")
    one = trained[wrong]
    cost = one.evaluations["cost"].copy()
    cost[-1] += 1e-9
    replace(one, evaluations=one.evaluations | {"cost": cost}).save(summaries.path_of(wrong))
    verified = command("verify")
    assert verified.exit_code == 1
    assert ": 1 contradiction\n" in verified.output
    assert "final_cost" in verified.output
    assert "ES" in verified.output


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_verify_makes_a_damaged_summary_again(command, trained, trains_here, share):
    command("study", "--publish")
    path = summaries.path_of(next(iter(STUDY)))
    content = bytearray(path.read_bytes())
    for place in range(400):  # more than what lies between the columns, which nobody reads
        content[int(share * len(content)) - place] ^= 0xFF
    path.write_bytes(bytes(content))
    verified = command("verify")
    assert verified.exit_code == 0, verified.output
    assert f"it is kept as {path.stem}.damaged, and the run is done again" in verified.output
    assert "6 runs compared with the published ones, 6 bit for bit: " in verified.output


@pytest.mark.parametrize("stored", [0, 1, 5])
def test_verify_trains_as_many_runs_as_are_asked_for_besides_those_that_are_stored(
    command, trained, trains_here, stored
):
    command("study", "--publish")
    for experiment in list(STUDY)[stored:]:
        summaries.path_of(experiment).unlink()
    if not stored:
        refused = command("verify")
        assert refused.exit_code == 1
        assert "--sample 5 trains five for the comparison" in refused.output
    verified = command("verify", "--sample", "2")
    assert verified.exit_code == 0, verified.output
    now = min(stored + 2, len(STUDY))
    assert f"{now} runs compared with the published ones, {now} bit for bit: " in verified.output
    assert sum(map(summaries.is_stored, STUDY)) == now


def test_verify_says_that_nothing_is_published(command, small):
    refused = command("verify")
    assert refused.exit_code == 1
    assert refused.output.startswith("Error: nothing is published in ")


def test_verify_says_that_what_is_published_is_damaged(command, trained, trains_here, tmp_path):
    command("study", "--publish")
    (tmp_path / "published/curves.npz").write_bytes(b"")
    published._load.cache_clear()
    refused = command("verify")
    assert refused.exit_code == 1
    assert "is damaged" in refused.output
    assert len(refused.output.splitlines()) == 1


@pytest.mark.parametrize(("outcome", "code"), [(rule.PARTLY, 0), (rule.UNDECIDABLE, 1)])
def test_bench_publishes_the_verdicts_on_time_only_where_they_are_decided(
    command, monkeypatch, outcome, code
):
    judged = Verdict("C3", "half the time", outcome, "0.65 [0.62, 0.68]", "")
    monkeypatch.setattr(publish, "publish_timing", lambda: (judged,))
    done = command("bench", "--publish")
    assert done.exit_code == code
    assert f"C3: {outcome}. 0.65" in done.output
    assert ("nothing is published" in done.output) == bool(code)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--table", "/nonexistent/d/x.csv"), "'/nonexistent/d/x.csv' cannot be written: No such"),
        (("--table", "/dev/null/x.csv"), "'/dev/null/x.csv' cannot be written: Not a directory"),
        (("--table", "."), "'.' is a directory"),
        (("--workers", "0"), "workers = 0 must be a whole number, 1 or more"),
        (("--workers", "999"), "; --yes starts them nevertheless"),
        (("--scheduler", "foo"), "the scheduler's address 'foo' must be HOST:PORT"),
        (("--security", "x.toml"), "--security needs --scheduler"),
    ],
)
def test_what_would_fail_at_the_end_of_a_study_is_refused_at_its_start(
    command, small, monkeypatch, words, sentence
):
    monkeypatch.setattr(summaries, "fetch_summaries", raising(AssertionError("work has begun")))
    refused = command("study", *words)
    assert refused.exit_code in (1, 2)
    assert sentence in refused.output
    assert isinstance(refused.exception, SystemExit)


def test_a_place_that_cannot_be_published_to_is_refused_before_any_work(
    command, small, monkeypatch, tmp_path
):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "file/published"))
    monkeypatch.setattr(summaries, "fetch_summaries", pytest.fail)
    refused = command("study", "--publish")
    assert refused.exit_code == 1
    assert refused.output == f"Error: {tmp_path / 'file'} cannot be written: Not a directory\n"


def test_a_file_in_the_place_of_the_folder_of_runs_is_one_sentence(command, small, tmp_path):
    (tmp_path / "runs").write_text("")
    for words in (("study",), ("train",), ("runs",), ("evaluate", "x"), ("show", "x"), ("clean",)):
        done = command(*words)
        assert isinstance(done.exception, SystemExit | None), words
        assert "Traceback" not in done.output
        if words[0] not in ("runs", "clean"):
            assert done.exit_code == 1
            assert len(done.stderr.splitlines()) == 1


def test_bench_sweeps_over_as_many_problems_as_asked_for(command, monkeypatch):
    from nmpcrl.bench import sweep

    asked = []
    monkeypatch.setattr(sweep, "sweep", lambda problems: asked.append(problems) or "a table")
    for words in (("--sweep",), ("--sweep", "20")):
        done = command("bench", *words)
        assert done.output == f"a table\n{sweep.path()}: stored\n"
    assert asked == [100_000, 20]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("study", "--dry-run"), "cannot be a folder"),
        (("clean",), "cannot be a folder"),
        (("study", "--table", ""), "'' is not a path"),
    ],
)
def test_what_is_no_folder_and_no_path_is_refused_before_anything_is_done(
    words, said, tmp_path, monkeypatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "file"))
    refused = CliRunner().invoke(main, words)
    assert refused.exit_code
    assert said in f"{refused.output}{refused.exception}"


def test_no_more_runs_are_compared_than_are_published():
    refused = CliRunner().invoke(main, ["verify", "--sample", "10000000000"])
    assert "10000000000 is more than the 2,000 published runs." in refused.output


def test_a_study_without_numba_is_refused_in_a_sentence(monkeypatch, tmp_path):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    monkeypatch.setattr(summaries, "environment", lambda: {"numba": "absent"})
    refused = CliRunner().invoke(main, ["verify", "--sample", "1"])
    assert refused.exit_code == 1
    assert "Error: numba is not installed, and without it riccati" in refused.output


@pytest.mark.parametrize(
    "words",
    [
        ("bench", "--again", "--short"),
        ("bench", "--sweep", "20"),
        ("wasm",),
        ("train", "--box", "soft", "--episodes", "1"),
    ],
    ids=" ".join,
)
def test_what_needs_machine_code_says_so_at_once_without_numba(words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    monkeypatch.setattr(limits, "environment", lambda: {"numba": "absent"})
    refused = CliRunner().invoke(main, words)
    assert refused.exit_code == 1
    (sentence,) = refused.output.strip().splitlines()
    assert re.fullmatch(r"Error: numba is not installed, and .+: `pip install numba`", sentence)
    assert not list(tmp_path.iterdir())


HELP = """
import sys
from nmpcrl import commands
for name in commands.main.commands:
    try:
        commands.main([name, "--help"], prog_name="nmpcrl")
    except SystemExit as ended:
        assert not ended.code, name
"""


def test_every_command_explains_itself_where_a_terminal_knows_no_letters_but_ascii():
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, env=plain, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.count(b"Usage: nmpcrl ") == len(main.commands)
