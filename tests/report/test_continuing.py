"""The same run as a command and as code: both are executed, and give its numbers."""

import shlex
import subprocess
from dataclasses import fields

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from nmpcrl.commands import main
from nmpcrl.report.continuing import code, command
from nmpcrl.study import Experiment, Records, run
from nmpcrl.study.learners import NETWORKS
from nmpcrl.study.provenance import key
from nmpcrl.study.store import RUNS as STORE

SHORT = {"episodes": 2, "steps": 20, "evaluate_every": 1}
RUNS = {
    "drawn": Experiment(
        "GES",
        seed=3,
        layout=((0.5, 2.2), (-1, 0.5)),
        start=(-1, -1, 0.5),
        target=(6, 6, 0),
        **SHORT,
    ),
    "named": Experiment("TDC", layout="D", projected=False, theta=(0.9,) * 9, **SHORT),
    "a network": Experiment("RDES", network="small buffer", gated=False, decay_rate=0.5, **SHORT),
}


def typed(text: str) -> list[str]:
    """A command's words as a shell makes them, after `nmpcrl`."""
    said = subprocess.run(["sh", "-c", f"printf '%s\\0' {text}"], capture_output=True, text=True)
    program, *words, _ = said.stdout.split("\0")
    assert program == "nmpcrl"
    return words


@pytest.mark.parametrize("name", RUNS)
def test_the_command_trains_the_run_in_a_shell(name, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    done = CliRunner().invoke(main, typed(command(RUNS[name])))
    assert done.exit_code == 0, done.output
    stored = Records.load(STORE.path_of(RUNS[name]))
    assert key(Experiment(**stored.experiment)) == key(RUNS[name])
    np.testing.assert_array_equal(stored.steps["theta"], run(RUNS[name]).steps["theta"])


@pytest.mark.parametrize("name", RUNS)
def test_the_code_trains_the_run_and_prints_its_last_cost_and_theta(name, capsys):
    exec(code(RUNS[name]), {"__name__": "__main__"})
    stopped, cost, *theta = capsys.readouterr().out.splitlines()
    records = run(RUNS[name])
    assert stopped == records.facts["stopped"]
    assert float(cost) == records.facts["final_cost"]
    assert " ".join(theta) == " ".join(str(records.steps["theta"][-1]).splitlines())


numbers = st.floats(-3, 9)
poses = st.tuples(numbers, numbers, st.floats(-3, 3))
experiments = st.builds(
    Experiment,
    learner=st.sampled_from(["ES", "RDES", "GES", "TDC", "frozen"]),
    layout=st.sampled_from("AF") | st.lists(st.tuples(numbers, numbers), min_size=1, max_size=16),
    start=poses,
    target=poses,
    alpha=st.floats(1e-12, 1e-3),
    gated=st.booleans(),
    clipped=st.booleans(),
    network=st.sampled_from([*NETWORKS]),
    theta=st.tuples(*[st.floats(-10, 10)] * 9),
)


@settings(deadline=None)
@given(experiments)
def test_the_options_name_the_run_whatever_its_fields_are(experiment):
    _, name, *words = shlex.split(command(experiment).replace("\\\n", ""))
    with main.commands[name].make_context(name, words) as context:
        given = {one.name: context.params[one.name] for one in fields(Experiment)}
    assert Experiment(**given) == experiment.canonical
