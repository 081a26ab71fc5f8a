"""`nmpcrl train`, `runs` and `show`, used one after the other."""

from dataclasses import fields

import pytest

from nmpcrl.commands.runs import costs_of
from nmpcrl.study import Experiment, Records, fetch, paper, sweep
from nmpcrl.study.provenance import key
from nmpcrl.study.store import RUNS

SHORT = {"episodes": 2, "steps": 4, "evaluate_every": 1}
WORDS = ["--episodes", "2", "--steps", "4", "--evaluate-every", "1"]
OTHERS = {  # another value than the default, as one types it
    "start": ("0,1,2", (0.0, 1.0, 2.0)),
    "target": ("0 -1 2", (0.0, -1.0, 2.0)),
    "theta": ("1,1,0.05,0.05,0.05,1,1,0.1,0.002", (*paper.THETA_INIT[:-1], 0.002)),
    "decay_rate": ("0.5", 0.5),
    "tolerance": ("1e-7", 1e-7),
}


@pytest.fixture
def asked(monkeypatch):
    """The experiments that would be trained; none is."""
    asked = []

    def fetch(experiment, **_):
        asked.append(experiment)
        raise KeyboardInterrupt

    monkeypatch.setattr("nmpcrl.study.fetch", fetch)
    return asked


def words_of(field) -> tuple[list[str], object]:
    """An option that sets a field, and the value that it then has."""
    name, choices = field.name.replace("_", "-"), field.metadata["allowed"].choices
    if isinstance(field.default, bool):
        return [f"--no-{name}" if field.default else f"--{name}"], not field.default
    if field.name in OTHERS:
        word, value = OTHERS[field.name]
    else:
        value = choices[1] if choices else 2 * field.default + 2
        word = str(value)
    return [f"--{name}", word], value


@pytest.mark.parametrize("field", fields(Experiment), ids=lambda field: field.name)
def test_every_field_of_an_experiment_is_an_option_with_its_help(command, asked, field):
    words, value = words_of(field)
    command("train", *words)
    assert asked == [Experiment(**{field.name: value})]
    text = " ".join(command("train", "--help").output.split()).replace("- ", "-")
    assert " ".join(field.metadata["help"].removesuffix(".").split()) in text
    if not isinstance(field.default, bool):
        assert field.metadata["allowed"].text in text


def test_a_run_is_trained_once_listed_and_drawn(command, tmp_path, monkeypatch):
    one = Experiment("GES", **SHORT)
    done = command("train", "--learner", "GES", *WORDS)
    assert done.exit_code == 0, done.output
    path = RUNS.path_of(one)
    assert f"{path}\nNext: nmpcrl show {path.stem}\n" in done.stdout
    monkeypatch.setattr("nmpcrl.study.store.run", lambda *_, **__: pytest.fail("trained again"))
    again = command("train", "--learner", "GES", *WORDS)
    assert again.stdout == done.stdout
    head, line = command("runs").stdout.splitlines()
    assert head.split()[:6] == ["run", "learner", "layout", "decay", "seed", "episodes"]
    assert line.split()[:6] == [path.stem, "GES", "A", "step", "0", "2"]
    for name in ("GES-A", path.stem, str(path)):
        shown = command("show", name)
        assert shown.exit_code == 0, shown.output
        assert shown.stdout == f"{costs_of(fetch(one))}\n{path.with_suffix('.svg')}\n"
    page = path.with_suffix(".svg").read_bytes()
    assert page.startswith(b"<?xml")
    assert command("show", "GES", "--out", str(tmp_path / "a.PNG")).exit_code == 0
    assert (tmp_path / "a.PNG").read_bytes().startswith(b"\x89PNG\r")


@pytest.fixture
def stored(command):
    """Four runs, of which one has an infinite cost and one was made by other code."""
    wanted = sweep(seed=(0, 1), layout=("A", "B"), **SHORT)
    records = fetch(wanted[0])
    for one, cost in zip(wanted, (9.0, 8.0, 7.0, float("inf")), strict=True):
        facts = records.facts | {"final_cost": cost, "key": key(one)}
        facts |= {"sources": "other"} if cost == 7 else {}
        named = records.experiment | {"seed": one.seed, "layout": one.layout}
        Records(named, records.steps, records.evaluations, facts).save(RUNS.path_of(one))
    return [RUNS.path_of(one).stem for one in wanted]


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("", [0, 2, 1, 3]),
        ("ES-A", [0, 2]),
        ("*-seed1", [2, 3]),
        ("--sort cost", [2, 1, 0, 3]),
        ("--sort layout --reverse", [1, 3, 0, 2]),
        ("GES", []),
    ],
)
def test_runs_are_picked_by_name_and_sorted_by_a_column(command, stored, line, found):
    table = command("runs", *line.split()).stdout.splitlines()[1:]
    assert [one.split()[0] for one in table] == [stored[k] for k in found]


def test_a_run_that_could_not_be_stored_is_reported_and_fails(command, monkeypatch):
    from nmpcrl.study import run

    monkeypatch.setattr("nmpcrl.study.fetch", lambda one, **_: run(one))
    done = command("train", *WORDS)
    assert done.exit_code == 1
    assert "noise-free cost" in done.stdout
    assert "Next" not in done.stdout
