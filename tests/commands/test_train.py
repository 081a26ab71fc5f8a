"""`nmpcrl train`: an option for every field, made from the class, and refusals before any work."""

from dataclasses import fields, replace

import pytest
from click.testing import CliRunner

from nmpcrl.commands import main
from nmpcrl.commands.fields import joined
from nmpcrl.study import Experiment, paper, store
from nmpcrl.study.experiment import frozen_arm

FIELDS = fields(Experiment)
THETA = "1,1,0.05,0.05,0.05,1,1,0.1,0.002"
OTHERS = {  # another value than the default, as one types it
    "learner": ("RDES", "RDES"),
    "layout": ("B", "B"),
    "start": ("0,1,2", (0.0, 1.0, 2.0)),
    "target": ("0 -1 2", (0.0, -1.0, 2.0)),
    "decay": ("episode", "episode"),
    "network": ("tanh", "tanh"),
    "box": ("soft", "soft"),
    "solver": ("fatrop", "fatrop"),
    "theta": (THETA, (*paper.THETA_INIT[:-1], 0.002)),
    "decay_rate": ("0.5", 0.5),
    "tolerance": ("1e-7", 1e-7),
}


@pytest.fixture
def asked(monkeypatch):
    """Which experiments would be trained; none is."""
    asked = []

    class Seen(Exception):
        pass

    def fetch(experiment, **_):
        asked.append(experiment)
        raise Seen

    monkeypatch.setattr("nmpcrl.study.fetch", fetch)
    return asked


def words_of(field) -> tuple[list[str], object]:
    """An option that sets a field, and the value that it then has."""
    name = field.name.replace("_", "-")
    if isinstance(field.default, bool):
        return [f"--no-{name}" if field.default else f"--{name}"], not field.default
    if field.name in OTHERS:
        word, value = OTHERS[field.name]
    else:
        value = 2 * field.default + 2
        word = str(value)
    return [f"--{name}", word], value


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_every_field_of_an_experiment_is_an_option(command, asked, field):
    words, value = words_of(field)
    command("train", *words)
    assert asked == [Experiment(**{field.name: value})]


def test_without_options_it_is_the_papers_run(command, asked):
    command("train")
    assert asked == [Experiment()]


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_the_help_has_what_the_class_says_of_a_field(field):
    text = " ".join(CliRunner().invoke(main, ["train", "--help"]).output.split()).replace("- ", "-")
    assert f"--{field.name.replace('_', '-')} " in text
    assert " ".join(field.metadata["help"].removesuffix(".").split()) in text
    if not isinstance(field.default, bool):
        assert field.metadata["allowed"].text in text


def test_literal_is_another_name_of_not_gated(command, asked):
    command("train", "--learner", "RDES", "--literal")
    assert asked == [Experiment("RDES", gated=False)]


@pytest.mark.parametrize(
    "words",
    [(THETA,), (THETA.replace(",", " "),), THETA.split(",")],
    ids=["commas", "text", "words"],
)
def test_theta_is_nine_numbers_however_they_are_separated(command, asked, words):
    command("train", "--theta", *words, "--seed", "3")
    assert asked == [Experiment(seed=3, theta=OTHERS["theta"][1])]


@pytest.mark.parametrize(
    "words",
    [("0.5,2.2 -3,0.5",), ("0.5,2.2", "-3,0.5"), ("0.5", "2.2", "-3", "0.5"), ("0.5,2.2,-3,0.5",)],
)
def test_a_layout_is_a_name_or_centres_however_they_are_separated(command, asked, words):
    command("train", "--layout", *words, "--start", "-1", "0", "1", "--seed", "3")
    assert asked == [Experiment(seed=3, layout=((0.5, 2.2), (-3, 0.5)), start=(-1, 0, 1))]


def test_negative_numbers_of_a_vector_are_no_options():
    assert joined(["--theta", "1", "-2", "3", "--seed", "-4"]) == [
        "--theta",
        "1,-2,3",
        "--seed",
        "-4",
    ]
    assert joined(["--layout", "D", "3"]) == ["--layout", "D", "3"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--theta", "1,2"), "theta = (1.0, 2.0) must be 9 numbers of size at most 1e+06"),
        (("--theta", "1,x"), "'1,x' is not a list of numbers"),
        (("--layout", "1,2 3"), "layout = '1,2 3' must be one of A, B"),
        (("--start", "1,2"), "start = (1.0, 2.0) must be 3 numbers: x in [-3, 9]"),
        (("--seed", "x"), "'x' is not a valid int"),
        (("--alpha", "nan"), "alpha = nan must be a number in (0, 1e+06]"),
        (("--no-clipped", "--constrained"), "clipped = False leaves actions"),
        (("--episodes", "10000", "--horizon", "500", "--solver", "ipopt"), "and more with --yes"),
    ],
)
def test_what_cannot_be_done_is_refused_before_any_work(command, asked, tmp_path, words, said):
    refused = command("train", *words)
    assert refused.exit_code in (1, 2)
    assert said in refused.output
    assert not asked
    assert not (tmp_path / "runs").exists()


def test_a_long_run_is_trained_by_who_is_sure(command, asked):
    command("train", "--episodes", "10000", "--horizon", "500", "--solver", "ipopt", "--yes")
    assert [e.episodes for e in asked] == [10_000]


def test_a_trained_run_says_where_it_is_and_what_to_type_next(command, tmp_path):
    path = store.path_of(Experiment(episodes=1, steps=5))
    done = command("train", "--episodes", "1", "--steps", "5")
    assert done.exit_code == 0, done.output
    name = path.stem
    assert f"{tmp_path / 'runs' / path.name}: finished" in done.stdout
    assert f"Next: nmpcrl show {name}\n" in done.stdout
    assert f"nmpcrl compare {name} RUN\n" in done.stdout


@pytest.mark.parametrize("other", [{"layout": "B"}, {"steps": 6}, {"learner": "GES"}, {}])
def test_a_trained_run_is_to_be_compared_with_its_frozen_arm_and_with_no_other(command, other):
    own = Experiment(episodes=1, steps=5)
    stored = replace(own, **other) if other else frozen_arm(own)
    store.fetch(stored)
    done = command("train", "--episodes", "1", "--steps", "5")
    name = "RUN" if other else store.path_of(stored).stem
    assert f"nmpcrl compare {store.path_of(own).stem} {name}\n" in done.stdout


def test_a_run_that_cannot_be_stored_is_refused_before_it_is_trained(command, asked, tmp_path):
    (tmp_path / "runs").write_text("a file")
    refused = command("train", "--episodes", "1")
    assert refused.exit_code == 1
    assert refused.output.startswith(f"Error: {tmp_path / 'runs'}")
    assert len(refused.output.splitlines()) == 1
    assert not asked


def test_the_verdict_of_a_run_that_could_not_be_stored_is_told_all_the_same(command, monkeypatch):
    def run_only(experiment, **_):
        from nmpcrl.study import run

        return run(experiment)

    monkeypatch.setattr("nmpcrl.study.fetch", run_only)
    done = command("train", "--episodes", "1", "--steps", "5")
    assert done.exit_code == 1
    assert "noise-free cost" in done.stdout
    assert "Next" not in done.stdout
