"""When a benchmark is read and when it is measured, and what the command prints."""

import json

import pytest
from click.testing import CliRunner

from nmpcrl.bench import suite
from nmpcrl.commands import main
from nmpcrl.study import ParameterError, StoreError
from nmpcrl.study.files import folder


@pytest.fixture
def waited():
    """The share of the time that learning steps wait for a processor, when they are measured."""
    return [0.0]


@pytest.fixture
def counted(tmp_path, monkeypatch, waited):
    """The lengths that were measured, in a folder of their own; measuring takes no time."""
    lengths = []

    def stages(size):
        def steps():
            lengths.append(next(name for name, one in suite.LENGTHS.items() if one == size))
            return {"learners": {"waited": [0.0, waited[0]]}}

        return [(suite.STEPS, steps), ("nothing", lambda: {"nothing": {"seconds": [1.0]}})]

    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setattr(suite, "_stages", stages)
    monkeypatch.setattr(suite.psutil, "cpu_percent", lambda _: 25.0)  # it would watch for a second
    return lengths


def measured_here(length, **options):
    return suite.read_or_measure(length, progress=False, **options)


def test_what_was_measured_is_read_again(counted):
    first = measured_here("short")
    assert measured_here("short") == first
    assert counted == ["short"]


@pytest.mark.parametrize(
    ("kept", "asked", "again"),
    [("full", "short", False), ("short", "smoke", False), ("smoke", "short", True)],
)
def test_a_longer_benchmark_serves_for_a_shorter_one(counted, kept, asked, again):
    measured_here(kept)
    found = measured_here(asked)
    assert counted == ([kept, asked] if again else [kept])
    assert found["about"]["length"] == (asked if again else kept)


@pytest.mark.parametrize("changed", ["versions", "machine"])
def test_other_versions_or_another_machine_measure_again(counted, monkeypatch, changed):
    measured_here("short")
    monkeypatch.setattr(suite, changed, lambda: {"other": "one"})
    measured_here("short")
    assert counted == ["short", "short"]


@pytest.mark.parametrize("what", ["sources_hash", "code"])
def test_another_source_measures_again(counted, monkeypatch, what):
    measured_here("short")
    monkeypatch.setattr(suite.lock, what, lambda *_: "other")
    measured_here("short")
    assert counted == ["short", "short"]


@pytest.mark.parametrize("content", ["{", "[]", "{}", '{"about": {"key": "KEY"}}'])
def test_a_damaged_file_is_told_and_measured_again(counted, capsys, content):
    measured_here("short")
    suite.path().write_text(content.replace("KEY", suite.depends_on()))
    measured_here("short")
    assert counted == ["short", "short"]
    assert "is damaged" in capsys.readouterr().err


def test_what_is_asked_for_alone_is_measured_alone_and_then_read_with_the_rest(counted):
    alone = measured_here("short", only=[suite.STEPS])
    assert "nothing" not in alone
    assert "nothing" in measured_here("short")
    assert counted == ["short"]


def test_who_asks_for_all_but_the_learners_waits_for_no_learner():
    assert suite.STEPS not in suite.OTHERS
    assert {suite.STEPS, *suite.OTHERS} == {
        name for name, _ in suite._stages(suite.LENGTHS["full"])
    }


def test_an_interrupted_benchmark_keeps_the_stages_that_it_has_measured(counted, monkeypatch):
    stages = suite._stages

    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr(suite, "_stages", lambda size: [stages(size)[0], ("cut", interrupted)])
    with pytest.raises(KeyboardInterrupt):
        measured_here("short")
    monkeypatch.setattr(suite, "_stages", stages)
    measured_here("short")
    assert counted == ["short"]


def test_steps_that_were_timed_on_a_busy_machine_are_timed_again_where_calm_is_asked_for(
    counted, waited
):
    waited[0] = 0.5
    measured_here("short")
    measured_here("short")
    assert counted == ["short"]
    waited[0] = 0.0
    measured_here("short", calm=True)
    measured_here("short", calm=True)
    assert counted == ["short", "short"]


def test_a_benchmark_in_stages_says_of_all_together_the_least_length(counted):
    measured_here("full", only=[suite.STEPS])
    about = measured_here("smoke")["about"]
    assert about["length"] == "smoke"
    assert about["seconds"] >= 0


def test_without_a_folder_to_keep_it_in_nothing_is_measured(counted, monkeypatch):
    folder().write_text("no folder")
    with pytest.raises(StoreError, match="cannot be written"):
        measured_here("short")


def test_the_file_is_whole_and_alone(counted):
    bench = measured_here("short")
    assert json.loads(suite.path().read_text()) == bench
    assert list(suite.path().parent.iterdir()) == [suite.path()]


def test_a_benchmark_says_where_and_of_what_it_is(counted):
    about = measured_here("short")["about"]
    assert about["others"] == 0.25
    assert about["length"] == "short"
    assert about["machine"].keys() == {"processor", "architecture", "cores", "system"}
    assert {"python", "casadi", "numpy", "torch", "mpcrl"} <= about["versions"].keys()


@pytest.mark.parametrize("length", ["long", "", None, True, 3, ["full"]])
def test_a_length_that_there_is_not_is_refused(counted, length):
    with pytest.raises(ParameterError, match="must be one of smoke, short, full"):
        measured_here(length)
    assert not counted


@pytest.fixture
def command(counted, measured, monkeypatch):
    stage = [("all", lambda: {name: part for name, part in measured.items() if name != "about"})]
    stages = suite._stages
    monkeypatch.setattr(suite, "_stages", lambda size: [*stages(size), *stage])
    return lambda *words: CliRunner().invoke(main, ["bench", *words])


def test_the_command_prints_a_row_a_figure_and_where_it_is_kept(command, counted):
    done = command()
    assert done.exit_code == 0, done.output
    assert counted == ["full"]
    lines = [line for line in done.stdout.splitlines() if " | " in line]
    assert len(lines) == 17
    assert sum(line.rstrip().endswith("| reached") for line in lines) == 16
    assert f"{suite.path()}: full, " in done.stdout


def test_the_command_measures_again_only_when_told(command, counted):
    command("--short")
    command("--smoke")
    assert counted == ["short"]
    command("--smoke", "--again")
    assert counted == ["short", "smoke"]
