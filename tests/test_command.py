"""The command `nmpcrl`, driven as a user drives it, on runs of two short episodes."""

import pytest
from click.testing import CliRunner

from nmpcrl.__main__ import main


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    return lambda *words: CliRunner().invoke(main, words)


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

    def refuse(*_, **__):
        raise AssertionError("the run was trained a second time")

    monkeypatch.setattr("nmpcrl.study.store.run", refuse)
    again = command("train", "--learner", "frozen", "--episodes", "1")
    assert again.exit_code == 0, again.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--learner", "SARSA"), "learner = 'SARSA' must be one of ES, DES, RDES, GES, frozen"),
        (("--episodes", "0"), "episodes = 0 must be a whole number, 1 or more"),
        (("--layout", "Z"), "layout = 'Z' must be one of A"),
        (("--alpha", "-1"), "alpha = -1.0 must be a positive number"),
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
