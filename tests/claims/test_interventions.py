"""Which runs of RDES are made again with one thing taken away, and how their ends are counted."""

from pathlib import Path

import pandas as pd
import pytest
from fixed_questions import assert_older, git

from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.claims import interventions
from nmpcrl.study.provenance import code

ROOT = Path(__file__).resolve().parents[2]
EXTENDED = "f8a3b4d"  # the commit that registered the other runs in drawn layouts


def test_the_runs_were_fixed_before_they_were_made():
    file = Path(interventions.__file__)
    assert_older(file, "book/published/interventions.json")
    path = file.relative_to(ROOT).as_posix()
    assert code(git("show", f"{EXTENDED}:{path}")) == code(file.read_text("utf-8"))
    last = [*interventions.runs()][-1]
    others = git("log", "--format=%H", f"-S{last}", "--", "book/published/interventions.json")
    for made in others.splitlines()[-1:]:
        assert git("rev-parse", EXTENDED) in git("rev-list", f"{made}^").split()


def test_all_stopped_runs_are_made_again_beginning_with_one_of_each_of_50_drawn_layouts():
    chosen = [name.split() for name in interventions.runs()]
    assert [part for part, *_ in chosen] == ["six"] * 37 + ["drawn"] * 133
    assert len({layout for part, layout, _ in chosen[37:87]}) == 50


def test_a_nudged_run_starts_a_little_beside_theta_init(monkeypatch):
    watched = []

    def watch(experiment, intervention="none"):
        watched.append((experiment.theta[0], intervention))
        return Outcome(True, *[pd.Series([1.0, 2.0]).to_numpy()] * 4)

    monkeypatch.setattr(interventions, "watch", watch)
    experiment = next(iter(interventions.runs().values()))
    assert [interventions.lived(experiment, arm) for arm in interventions.ARMS] == [1, 1, 1]
    assert watched[:2] == [(1.0, "theta held"), (1.0, "true slope")]
    assert watched[2] == (pytest.approx(1 + 1e-9, abs=1e-12), "none")


def test_a_share_draws_layouts_and_a_difference_pairs_runs():
    ends = {("A", 0): (False, True), ("A", 1): (False, True), ("B", 0): (True, True)}
    rows = [
        {"layout": layout, "seed": seed, "intervention": arm, "stopped": stopped}
        for (layout, seed), both in ends.items()
        for arm, stopped in [("none", True), *zip(("true slope", "nudged"), both, strict=True)]
    ]
    share = interventions.live(pd.DataFrame(rows), "true slope")
    assert (share.value, share.low, share.high) == (pytest.approx(2 / 3), 0, 1)
    assert interventions.live(pd.DataFrame(rows), "nudged").value == 0
    assert interventions.live(pd.DataFrame(rows), "true slope", "nudged").value == share.value
