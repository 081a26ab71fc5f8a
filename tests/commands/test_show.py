"""`nmpcrl show` and `nmpcrl compare`."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nmpcrl.analysis.comparison import compare
from nmpcrl.report.run import verdict
from nmpcrl.study import Experiment, fetch, run, store
from nmpcrl.study.experiment import frozen_arm

SHORT = {"steps": 5, "evaluate_every": 1}
RUNS = {
    "ES": Experiment(episodes=3, **SHORT),
    "GES": Experiment("GES", episodes=3, **SHORT),
    "frozen": Experiment("frozen", episodes=3, **SHORT),
    "one episode": Experiment(episodes=1, **SHORT),
    "diverged": Experiment(episodes=3, alpha=1e-2, **SHORT),
    "other layout": Experiment(episodes=3, layout="B", **SHORT),
}


@pytest.fixture(scope="module")
def known():
    return {name: run(experiment) for name, experiment in RUNS.items()}


@pytest.fixture
def stored(command):
    """The name of a run that is stored."""
    fetch(RUNS["ES"])
    return store.path_of(RUNS["ES"]).stem


@pytest.mark.parametrize(
    ("words", "place"),
    [
        ((), "runs/{}.svg"),
        (("--format", "png"), "runs/{}.png"),
        (("--out", "a.png"), "a.png"),
        (("--out", "a.SVG"), "a.SVG"),
        (("--out", "a", "--format", "svg"), "a"),
    ],
)
def test_show_writes_a_page_and_prints_its_path(
    command, stored, tmp_path, monkeypatch, words, place
):
    monkeypatch.chdir(tmp_path)
    done = command("show", stored[:8], *words)
    assert done.exit_code == 0, done.output
    path = tmp_path / place.format(stored)
    assert (tmp_path / done.stdout.strip()) == path
    begin = path.read_bytes()[:5]
    assert begin == (b"\x89PNG\r" if "png" in "".join([*words, place]) else b"<?xml")


def test_the_same_run_gives_the_same_picture(command, stored, tmp_path):
    for name in ("a.svg", "b.svg"):
        command("show", stored, "--out", str(tmp_path / name))
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_the_frozen_arm_is_trained_only_if_it_is_asked_for(command, stored):
    arm = store.path_of(frozen_arm(RUNS["ES"]))
    assert command("show", stored).exit_code == 0
    assert not arm.exists()
    assert command("show", stored, "--frozen").exit_code == 0
    assert arm.exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "a.pdf"), "must end in .svg or .png"),
        (("--out", "a.svg", "--format", "png"), "must end in .svg or .png"),
        (("--out", "a"), "must end in .svg or .png"),
        (
            ("--out", "nowhere/a.svg"),
            "'nowhere/a.svg' cannot be written: No such file or directory",
        ),
        (("--out", "."), "'.' is a directory"),
        (("--format", "gif"), "'gif' is not one of 'svg', 'png'"),
    ],
)
def test_a_page_that_cannot_be_written_is_refused(
    command, stored, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    refused = command("show", stored, *words)
    assert refused.exit_code in (1, 2)
    assert said in refused.output


def test_a_run_has_the_bits_of_itself(known):
    found = compare(known["ES"], run(RUNS["ES"]))
    assert found.same_bits
    assert not found.fields
    assert not found.warning
    assert found.theta[0] == found.cost[0] == 0


def test_one_bit_is_a_difference(known):
    records = known["ES"]
    theta = records.steps["theta"].copy()
    theta[-1, 8] = np.nextafter(theta[-1, 8], 1)
    found = compare(records, replace(records, steps=records.steps | {"theta": theta}))
    assert found.differing == ("steps/theta",)
    assert found.theta[1:] == ("c", 3)


def test_clocks_make_no_difference(known):
    records = known["ES"]
    seconds = records.steps["seconds"] + 1
    assert compare(records, replace(records, steps=records.steps | {"seconds": seconds})).same_bits


def test_what_is_compared_goes_as_far_as_both_do(known):
    found = compare(known["ES"], known["one episode"])
    assert found.fields == {"episodes": (3, 1)}
    assert found.theta[2] == 1
    assert compare(known["ES"], known["diverged"]).cost[1] == 0


def test_other_layouts_are_not_comparable(known):
    assert "layout" in compare(known["ES"], known["other layout"]).warning
    assert "steps" in compare(known["ES"], run(Experiment(episodes=1, steps=4))).warning


def test_a_file_that_is_not_the_frozen_arm_is_not_drawn_as_one(command):
    fetch(RUNS["ES"])
    alone = command("show", "ES-A").stdout
    drawn = Path(alone.strip()).read_bytes()
    fetch(RUNS["GES"]).save(store.path_of(RUNS["frozen"]))
    done = command("show", "ES-A")
    assert "it is not drawn" in done.stderr
    assert Path(done.stdout.strip()).read_bytes() == drawn


def test_compare_prints_fields_figures_and_differences(command):
    for name in ("ES", "GES", "other layout"):
        fetch(RUNS[name])
    done = command("compare", "ES-A", "GES-A")
    assert done.exit_code == 0, done.output
    assert "learner   " in done.stdout
    for name in ("ES", "GES"):
        assert verdict(fetch(RUNS[name])) in done.stdout
    assert "Numbers differ in " in done.stdout
    assert "Largest difference of theta: " in done.stdout
    assert not done.stderr
    assert (
        "All numbers but the measured times are equal" in command("compare", "ES-A", "ES-A").stdout
    )
    assert (
        "Warning: the costs are not comparable: other layout"
        in command("compare", "ES-A", "ES-B").stderr
    )


@pytest.mark.slow
def test_no_window_system_that_is_set_elsewhere_matters(tmp_path):
    command = [sys.executable, "-m", "nmpcrl"]
    environment = os.environ | {"NMPCRL_RUNS": str(tmp_path), "MPLBACKEND": "nonsense"}
    for words in (("train", "--episodes", "1", "--steps", "5"), ("show", "ES")):
        subprocess.run([*command, *words], check=True, env=environment, capture_output=True)
    assert list(tmp_path.glob("*.svg"))
