"""Judged entries are kept one by one: what was interrupted goes on, and nothing is done twice."""

import json

import numpy as np
import pytest

from nmpcrl.analysis import judgements
from nmpcrl.analysis.judgements import KEPT, judge_all, stored
from nmpcrl.analysis.kept import Wanted
from nmpcrl.analysis.suite import Judgement, entry, judge, seed_of

ONE, OTHER = (Wanted("frozen", 1, name, seed_of(name, 0)) for name in ("J001", "T01"))
JUDGED = Judgement(initial=4000.0, cost=3000.0, arrived=True, episodes=5, seconds=1.0)


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch, trains_here):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))


@pytest.fixture
def counted(monkeypatch):
    """Judges nothing, and notes what was asked for."""
    asked = []

    def judge(one):
        asked.append(one)
        return JUDGED

    monkeypatch.setattr(judgements, "judge_named", judge)
    monkeypatch.setattr(judgements, "_compile_ahead", lambda missing: None)
    return asked


def test_what_is_kept_is_what_was_judged():
    found = judge_all([ONE, OTHER], progress=False)
    assert stored([ONE, OTHER]) == found
    assert found[ONE].cost == judge(entry("frozen"), "J001", ONE.seed, 1).cost


def test_nothing_is_judged_twice(counted):
    judge_all([ONE], progress=False)
    judge_all([ONE, OTHER, ONE], progress=False)
    assert counted == [ONE, OTHER]


def test_what_was_interrupted_goes_on(counted, monkeypatch):
    def judge(one):
        if one == OTHER:
            raise KeyError("interrupted")
        return JUDGED

    monkeypatch.setattr(judgements, "judge_named", judge)
    with pytest.raises(KeyError, match="interrupted"):
        judge_all([ONE, OTHER], progress=False)
    assert stored([ONE, OTHER]) == {ONE: JUDGED}


def test_a_failed_solve_is_kept_as_infinite(counted, monkeypatch):
    failed = Judgement(initial=4000.0, cost=np.inf, arrived=False, episodes=5, seconds=1.0)
    monkeypatch.setattr(judgements, "judge_named", lambda one: failed)
    judge_all([ONE], progress=False)
    assert stored([ONE])[ONE].cost == np.inf


def test_what_other_code_judged_is_judged_again(counted, capsys):
    judge_all([ONE], progress=False)
    path = KEPT.path_of(ONE)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"sources": "another"}))
    judge_all([ONE], progress=False)
    assert counted == [ONE, ONE]
    assert "is of code that is neither this nor locked" in capsys.readouterr().err


def test_a_damaged_file_is_judged_again(counted, capsys):
    judge_all([ONE], progress=False)
    KEPT.path_of(ONE).write_text("{")
    judge_all([ONE], progress=False)
    assert counted == [ONE, ONE]
    assert "is damaged" in capsys.readouterr().err
    assert json.loads(KEPT.path_of(ONE).read_text())["entry"] == "frozen"


@pytest.mark.parametrize("change", [{"EPOCH": 2}, {"versions": lambda: {"numpy": "0"}}])
def test_another_epoch_or_library_is_judged_anew(counted, monkeypatch, change):
    judge_all([ONE], progress=False)
    for name, value in change.items():
        monkeypatch.setattr(judgements, name, value)
    judge_all([ONE], progress=False)
    assert counted == [ONE, ONE]


def test_settings_and_budgets_have_files_of_their_own():
    others = [ONE._replace(entry="ES"), ONE._replace(entry="ES[alpha=3e-07]"), ONE]
    paths = {KEPT.path_of(one) for one in (*others, ONE._replace(budget=2))}
    assert len(paths) == 4
