"""1,500 drawn command lines: each ends in a sentence at most, and none in a traceback."""

import random

import click
import pandas as pd
import pytest
from builders import raising

from nmpcrl.analysis import summaries
from nmpcrl.bench import measurement
from nmpcrl.claims import publish, published, reproduce
from nmpcrl.commands import main
from nmpcrl.study import Experiment, cluster, fetch, jobs

LINES = 1500
SHORT = Experiment(episodes=1, steps=5)
GOOD = ("ES", "GES", "A", "B", "episode", "0", "1", "2", "5", "1e-7", "0.5", "main", "svg", "run")
BAD = (
    *("", " ", "-1", "0x10", "1e999", "nan", "inf", "-inf", "NaN", "9" * 30, "9" * 5000, "1.5"),
    *("None", "[1, 2]", "é", "名前", "\u202e", "\udcff", "a\nb", "%s", "{}", "\\", "*", "~", "/"),
    *("/nonexistent/d/x.csv", "/dev/null/x", "x" * 300, "..", "--", "-", "@file"),
    *("tcp://", "tcp://nowhere", "tls://127.0.0.1:1", "foo", "1,1,1", "1,1,0,0,0,1,1,0,nan", "ES-"),
)
LONG = (  # replaced by a refusal
    *((summaries, "fetch_summaries"), (cluster, "executor"), (jobs, "processes")),
    *((publish, "publish_timing"), (reproduce, "relock")),
    *((measurement, "measure"), (measurement, "read_or_measure")),
)


@pytest.fixture
def fast(command, monkeypatch, tmp_path):
    """The command, with a stored run, where everything that takes long is refused."""
    monkeypatch.chdir(tmp_path)
    fetch(SHORT)
    refuse = raising(click.ClickException("not here"))
    monkeypatch.setattr("nmpcrl.study.fetch", refuse)
    monkeypatch.setattr("nmpcrl.report.figures.runs.run.run_page", refuse)
    known = published.Published({SHORT: None}, pd.DataFrame({"variant": ["main"]}))
    monkeypatch.setattr(published, "load", lambda: known)
    monkeypatch.setattr(published.Published, "verdicts", ())
    monkeypatch.setattr(reproduce, "sample", lambda *_: [SHORT])
    for module, name in LONG:
        monkeypatch.setattr(module, name, refuse)
    return command


def drawn(rng: random.Random) -> list[str]:
    """A command with some of its options and arguments, and some that are none."""
    name = rng.choice([*main.commands, *main.commands, rng.choice(BAD)])
    words = [name]
    one = main.commands.get(name)
    if one is None:
        return words
    with click.Context(one) as context:
        params = one.get_params(context)
    for param in rng.sample(params, min(len(params), rng.choice((0, 1, 2, 3, 6)))):
        if isinstance(param, click.Option):
            words.append(rng.choice([*param.opts, *param.secondary_opts]))
        if not getattr(param, "is_flag", False) or rng.random() < 0.05:
            words.append(rng.choice(rng.choice((GOOD, BAD))))
    return words + rng.choices((*GOOD, *BAD), k=rng.choice((0, 0, 1, 2)))


@pytest.mark.weekly
@pytest.mark.slow
def test_no_command_line_ends_in_a_traceback(fast):
    rng = random.Random(0)
    codes = []
    for _ in range(LINES):
        words = drawn(rng)
        ended = fast(*words)
        codes.append(ended.exit_code)
        assert ended.exception is None or isinstance(ended.exception, SystemExit), (words, ended)
        assert ended.exit_code in (0, 1, 2), words
        if ended.exit_code:
            errors = [line for line in ended.stderr.splitlines() if line.startswith("Error: ")]
            assert len(errors) == 1, (words, ended.stderr)
    assert min(codes.count(code) for code in (0, 1, 2)) > 50
