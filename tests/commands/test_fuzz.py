"""1,500 drawn command lines: each ends in a sentence at most, and none in a traceback."""

import random

import click
import pytest
from raising import raising

from nmpcrl.analysis import other_problems, summaries
from nmpcrl.bench import live, problem_times, suite, sweep
from nmpcrl.claims import publish, published, verification
from nmpcrl.commands import main
from nmpcrl.study import Experiment, Records, cluster, run, store
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.provenance import provenance
from nmpcrl.study.storage import executor

LINES = 1500
SHORT = Experiment(episodes=1, steps=5)
GOOD = ("ES", "GES", "A", "B", "episode", "0", "1", "2", "5", "1e-7", "0.5", "main", "svg", "run")
BAD = (
    *("", " ", "-1", "0x10", "1e999", "nan", "inf", "-inf", "NaN", "9" * 30, "9" * 5000, "1.5"),
    *("None", "[1, 2]", "é", "名前", "\u202e", "\udcff", "a\nb", "%s", "{}", "\\", "*", "~", "/"),
    *("/nonexistent/d/x.csv", "/dev/null/x", "x" * 300, "..", "--", "-", "@file", "\x00", "a\x00b"),
    *("tcp://", "tcp://nowhere", "tls://127.0.0.1:1", "foo", "1,1,1", "1,1,0,0,0,1,1,0,nan", "ES-"),
)


class NotTrained(click.ClickException):
    """What stands in for work that takes long."""


refuse = raising(NotTrained("not here"))


@pytest.fixture
def fast(command, monkeypatch, tmp_path):
    """The command, with a stored run, where everything that takes long is refused."""
    monkeypatch.chdir(tmp_path)
    one = run(SHORT)
    for experiment, learner in ((SHORT, "ES"), (frozen_arm(SHORT), "frozen")):
        fields = one.experiment | {"learner": learner}
        facts = one.facts | provenance(experiment)
        Records(fields, one.steps, one.evaluations, facts).save(store.path_of(experiment))
    monkeypatch.setattr("nmpcrl.study.fetch", refuse)
    monkeypatch.setattr(summaries, "fetch_summaries", refuse)
    monkeypatch.setattr(cluster, "executor", refuse)
    monkeypatch.setattr(publish, "publish_timing", refuse)
    monkeypatch.setattr(publish, "rejudge", refuse)
    monkeypatch.setattr(verification, "relock", refuse)
    monkeypatch.setattr(published, "load", lambda: published.Published(rows={SHORT: {}}))
    monkeypatch.setattr(verification, "sample", lambda *_: [SHORT])
    monkeypatch.setattr(executor, "processes", refuse)  # nothing that takes long does without
    for place, name in (
        (other_problems, "make"),
        (problem_times, "make"),
        (suite, "measure"),
        (suite, "read_or_measure"),
        (sweep, "sweep"),
        (live, "measure"),
    ):
        monkeypatch.setattr(place, name, refuse)
    monkeypatch.setattr(
        "nmpcrl.report.figures.runs.run.run_page", lambda *_: refuse()
    )  # a second each; tests of their own draw it
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
        names = [*param.opts, *param.secondary_opts] if isinstance(param, click.Option) else [None]
        option = rng.choice(names)
        words += [option] if option else []
        if not getattr(param, "is_flag", False) or rng.random() < 0.05:
            words.append(rng.choice(rng.choice((GOOD, BAD))))
    words += rng.choices((*GOOD, *BAD), k=rng.choice((0, 0, 1, 2)))
    return words


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
        assert "Traceback" not in ended.output, words
        assert ended.exit_code in (0, 1, 2), words
        if ended.exit_code:
            errors = [line for line in ended.stderr.splitlines() if line.startswith("Error: ")]
            assert len(errors) == 1, (words, ended.stderr)
    assert min(codes.count(code) for code in (0, 1, 2)) > 50


def test_the_stand_ins_stand_where_the_commands_look(fast):
    for line in (
        "train",
        "study",
        "verify --sample 1",
        "bench",
        "bench --sweep 5",
        "bench --live",
        "bench --problems",
        "bench --sizes",
        "show ES",
        "suite --policy ES",
        "remedies --part best",
    ):
        assert "not here" in fast(*line.split()).output, line
