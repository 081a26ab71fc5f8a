"""`nmpcrl runs`, and runs by the beginning of their names."""

import json
import shutil
from functools import partial

import numpy as np
import pytest
from click import ClickException
from click.testing import CliRunner

from nmpcrl.commands import main
from nmpcrl.commands.names import file_of
from nmpcrl.commands.tables import columns, counted, duration, size
from nmpcrl.learning import expected_sarsa
from nmpcrl.study import Experiment, Trial, fetch, fetch_all, paper, run, store, sweep
from nmpcrl.study.records import Records

TRAIN = "train --episodes 2 --steps 5 --evaluate-every 1"
DRAWN = ((0.5, 2.2), (3.0, 0.5))
SHORT = {"episodes": 2, "steps": 5, "evaluate_every": 1}
STORED = sweep(learner=("ES", "GES", "frozen"), seed=(0, 1), **SHORT) + sweep(
    layout=DRAWN, target=(6, 6, 0), **SHORT
)


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """The command on a folder with seven runs, which no test here changes."""
    from concurrent.futures import ThreadPoolExecutor

    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NMPCRL_RUNS", str(folder))
        with ThreadPoolExecutor(1) as one:
            fetch_all(STORED, executor=one, progress=False)
        yield lambda *words: CliRunner().invoke(main, words)


def listed(command, *words) -> list[str]:
    """The names in the table."""
    lines = command("runs", *words).stdout.splitlines()
    return [line.split()[0] for line in lines[1:-1]]


def names(**fields) -> set[str]:
    return {
        store.path_of(e).stem
        for e in STORED
        if all(getattr(e, name) == value for name, value in fields.items())
    }


@pytest.mark.parametrize(
    ("words", "fields"),
    [
        ((), {}),
        (("--learner", "GES"), {"learner": "GES"}),
        (("--learner", "ES", "--seed", "1"), {"learner": "ES", "seed": 1}),
        (("--clipped", "--seed", "0"), {"seed": 0}),
        (("--layout", "0.5,2.2 3,0.5"), {"layout": "0.5,2.2 3,0.5"}),
        (("--target", "6,6,0"), {"target": (6, 6, 0)}),
        (("--layout", "A", "--layout", "0.5 2.2 3 0.5"), {}),
        (("--theta", "1,1,0.05,0.05,0.05,1,1,0.1,0.001", "--seed", "0"), {"seed": 0}),
    ],
)
def test_options_pick_runs_by_any_field(command, words, fields):
    assert set(listed(command, *words)) == names(**fields)


def test_an_option_given_twice_picks_runs_of_either_value(command):
    found = listed(command, "--learner", "ES", "--learner", "frozen")
    assert set(found) == names(learner="ES") | names(learner="frozen")


def test_where_nothing_is_picked_it_says_so(command):
    said = command("runs", "--layout", "F")
    assert said.exit_code == 0
    assert said.output.startswith("No run in ")


@pytest.mark.parametrize("column", ["cost", "size", "seed", "layout", "run", "theta", "target"])
def test_any_column_and_any_field_sorts(command, column):
    measured = {
        "cost": lambda row: row["facts"]["final_cost"],
        "size": lambda row: row["bytes"],
        "run": lambda row: row["run"],
    }
    value = measured.get(column, lambda row: row["experiment"].get(column))
    for reverse in ((), ("--reverse",)):
        rows = json.loads(command("runs", "--sort", column, *reverse, "--json").stdout)
        values = [value(row) for row in rows]
        assert values == sorted(values, reverse=bool(reverse))
        assert len(rows) == len(STORED)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--sort", "costs"), "sort = 'costs' must be one of run, cost, minutes, size, stopped"),
        (("--learner", "SARSA"), "learner = 'SARSA' must be one of ES"),
        (("--seed", "-1"), "seed = -1 must be a whole number"),
    ],
)
def test_what_no_run_can_be_is_refused(command, words, said):
    refused = command("runs", *words)
    assert refused.exit_code == 1
    assert refused.output.startswith(f"Error: {said}")


def test_the_table_ends_with_what_it_adds_up_to(command):
    last = command("runs").stdout.splitlines()[-1]
    whole = sum(store.path_of(e).stat().st_size for e in STORED)
    assert last.startswith(f"{len(STORED)} runs, {size(whole)}, ")


def test_json_has_what_the_help_says_and_no_infinity(command, tmp_path, monkeypatch):
    (row,) = json.loads(command("runs", "--learner", "GES", "--seed", "0", "--json").stdout)
    assert set(row) == {"run", "path", "bytes", "experiment", "facts"}
    assert Experiment(**row["experiment"]) in STORED
    assert {"stopped", "final_cost", "seconds", "solver"} <= set(row["facts"])
    records = Records.load(store.path_of(STORED[0]))
    records.facts["final_cost"] = float("inf")
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    records.save(store.path_of(STORED[0]))
    text = command("runs", "--json").stdout
    assert json.loads(text, parse_constant=pytest.fail)[0]["facts"]["final_cost"] is None


def test_nothing_stored_is_an_empty_list_for_programs(command, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    assert json.loads(command("runs", "--json").stdout) == []


def test_the_beginning_of_a_name_is_enough_where_no_other_begins_so(command):
    whole = command("evaluate", store.path_of(STORED[2]).stem)
    assert whole.exit_code == 0, whole.output
    assert command("evaluate", "GES-A-step-seed0").stdout == whole.stdout
    assert command("evaluate", str(store.path_of(STORED[2]))).stdout == whole.stdout


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("GES", "'GES' is the beginning of several runs: GES-A-step-seed0-2ep-"),
        ("GSE-A-step-seed0", "there is no run 'GSE-A-step-seed0' in "),
        ("nothing.npz", "there is no run 'nothing.npz' in "),
        ("", "'' is the beginning of several runs: ES-A-step-seed0-2ep-"),
        ("\udcff", r"there is no run '\udcff' in "),
    ],
)
def test_a_name_that_is_none_or_several_lists_those_that_come_close(command, name, said):
    for words in (("evaluate", name), ("show", name), ("compare", name, name)):
        refused = command(*words)
        assert refused.exit_code == 1
        assert refused.output.startswith(f"Error: {said}")
        assert "GES-A-step-seed0-2ep-" in refused.output
        assert len(refused.output.splitlines()) == 1


def test_the_shell_completes_commands_options_learners_and_runs(command, monkeypatch):
    def completed(*words: str) -> list[str]:
        monkeypatch.setenv("COMP_WORDS", " ".join(["nmpcrl", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        asked = CliRunner().invoke(
            main, prog_name="nmpcrl", env={"_NMPCRL_COMPLETE": "bash_complete"}, complete_var=None
        )
        return [line.partition(",")[2] for line in asked.stdout.splitlines()]

    assert completed("comp") == ["compare", "completion"]
    assert "--evaluate-every" in completed("train", "--eval")
    assert completed("train", "--learner", "G") == ["GES"]
    assert completed("runs", "--layout", "B") == ["B"]
    assert set(completed("show", "GES-")) == names(learner="GES")
    assert set(completed("compare", "ES", "fro")) == names(learner="frozen")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_is_the_shells_own(command, shell):
    script = command("completion", shell)
    assert script.exit_code == 0
    assert f"_NMPCRL_COMPLETE={shell}_complete" in script.stdout
    assert command("completion", "tcsh").exit_code == 2


def test_text_in_columns():
    assert columns([["a", "1"], ["bcd", "20"]], frozenset({1})) == ["a     1", "bcd  20"]


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "0 B"), (999, "999 B"), (1000, "1.0 kB"), (8.1e6, "8.1 MB"), (2e13, "20000.0 GB")],
)
def test_sizes_as_people_write_them(count, text):
    assert size(count) == text


@pytest.mark.parametrize(("seconds", "text"), [(3, "3 s"), (120, "2.0 min"), (7200, "2.0 h")])
def test_durations_as_people_write_them(seconds, text):
    assert duration(seconds) == text


def test_a_cost_that_is_not_known_sorts_last():
    from nmpcrl.commands.runs import _order

    assert sorted([np.nan, 2.0, None, 1.0], key=_order)[:2] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 runs"), (1, "1 run"), (2, "2 runs"), (1760, "1,760 runs")]
)
def test_one_is_singular(count, words):
    assert counted(count, "run") == words


def test_a_shorter_run_does_not_make_the_name_of_the_papers_ambiguous(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    whole, short = (store.path_of(Experiment("GES", episodes=n)) for n in (300, 2))
    for path in (short, short.with_stem(short.stem.replace("2ep", "20ep"))):
        path.touch()
    with pytest.raises(ClickException, match="is the beginning of several runs"):
        file_of("GES-A-step-seed0")
    whole.touch()
    assert file_of("GES-A-step-seed0") == whole
    assert file_of(short.stem) == short
    with pytest.raises(ClickException, match="is the beginning of several runs"):
        file_of("GES-A")


@pytest.mark.slow
@pytest.mark.parametrize("words", [("evaluate",), ("show",), ("compare", "ES-A-step-seed0")])
def test_a_run_under_the_name_of_another_is_refused(words, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    right, wrong = (Experiment(name, **SHORT) for name in ("ES", "GES"))
    fetch_all([right], progress=False)
    shutil.copy(store.path_of(right), store.path_of(wrong))
    (tmp_path / "below").mkdir()
    for name in ("GES-A-step-seed0", str(tmp_path / "below/.." / store.path_of(wrong).name)):
        refused = CliRunner().invoke(main, [*words, name])
        assert refused.exit_code == 1
        assert f"holds another run, {store.path_of(right).stem}" in refused.output


def test_what_does_not_say_which_code_made_it_is_no_run_of_the_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    path = store.path_of(Experiment(**SHORT))
    path.parent.mkdir()
    run(Experiment(**SHORT)).save(path)
    said = CliRunner().invoke(main, ["evaluate", path.stem]).output
    assert "does not say which code made it" in said
    elsewhere = path.rename(tmp_path / "mine.npz")
    assert CliRunner().invoke(main, ["evaluate", str(elsewhere)]).exit_code == 0


@pytest.mark.parametrize("words", ["runs", "evaluate ES", "show ES", "compare ES ES"])
def test_a_run_of_other_code_is_read_and_that_is_said(words, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    records = fetch(Experiment(**SHORT))
    assert CliRunner().invoke(main, words.split()).stderr == ""
    records.facts["sources"] = "another"
    records.save(store.path_of(Experiment(**SHORT)))
    done = CliRunner().invoke(main, words.split())
    assert done.exit_code == 0
    assert "code that is neither this nor locked" in done.stderr


def test_nothing_in_a_file_is_a_command_to_the_terminal(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    records = fetch_all([Experiment(**SHORT)], progress=False)[Experiment(**SHORT)]
    records.facts["stopped"] = "diverged: \x1b[31mred\x1b]0;title\x07"
    records.save(store.path_of(Experiment(**SHORT)))
    (tmp_path / "none\x1b[31m\x07.npz").write_text("damaged")
    asked = ("runs", TRAIN, "evaluate ES", "compare ES ES", "clean", "evaluate non", "show nobody")
    for words in map(str.split, asked):
        said = CliRunner().invoke(main, words).output
        assert "\x1b" not in said
        assert "\x07" not in said


def test_runs_of_ones_own_are_counted_kept_and_not_drawn_in_a_sentence(command):
    make = partial(expected_sarsa, alpha=paper.ALPHA)
    trial = Trial("mine", make, paper.nmpc(), paper.THETA_INIT, episodes=1, steps=3)
    fetch(trial)
    place = store.path_of(trial)
    try:
        for words, consequence in ((["runs"], "not listed"), (["clean"], "they are kept")):
            said = command(*words).stderr
            assert f"1 trial of your own in {place.parent}: " in said
            assert consequence in said
        for name in (place.stem, str(place)):
            done = command("show", name)
            assert done.exit_code == 1
            assert "is a run of a Trial" in done.stderr
    finally:
        shutil.rmtree(place.parent)
    assert command("runs").stderr == ""
