"""Verdicts are published anew from what is published, and those on time unless it was too busy."""

import pandas as pd
import pytest

from nmpcrl.claims import publish, published
from nmpcrl.claims.assumptions import THEOREMS
from nmpcrl.claims.rule import Assumption
from nmpcrl.claims.verdict import PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.study import Experiment


def timings(width: float) -> pd.DataFrame:
    """Ratios with intervals as wide on either side."""
    rows = [
        {"solver": "ipopt", "learner": name, "ratio": ratio, "waited": 0.5}
        | {"ratio_low": ratio - width, "ratio_high": ratio + width}
        for name, ratio in {"ES": 1.0, "RDES": 0.65, "GES": 1.0}.items()
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("width", "outcomes"), [(0.02, [PARTLY, REPRODUCED]), (0.07, [UNDECIDABLE, REPRODUCED])]
)
def test_verdicts_on_time_are_published_if_all_are_decided(monkeypatch, width, outcomes):
    kept = []
    taken = timings(width)
    monkeypatch.setattr(publish, "time_learners_repeatedly", lambda: taken)
    monkeypatch.setattr(publish.published, "republish", lambda *both: kept.append(both))
    judged = publish.publish_timing()
    assert [verdict.claim for verdict in judged] == ["C3", "C4"]
    assert [verdict.outcome for verdict in judged] == outcomes
    assert kept == ([(judged, taken)] if UNDECIDABLE not in outcomes else [])


def test_what_is_published_gives_its_verdicts_again_without_a_run():
    found = published.load()
    assert publish.judge_published(found) == found.verdicts


def test_verdicts_are_published_in_the_place_of_those_that_were_there(monkeypatch):
    kept, study = [], {publish.AUDITED: "records"}
    monkeypatch.setattr(publish, "fetch_all", lambda *_, **__: study)
    monkeypatch.setattr(publish, "dropped_curvature", lambda records: f"of {records}")
    held = Assumption("a finite MDP", "it is not", holds=False, by=THEOREMS)
    monkeypatch.setattr(publish, "audit", lambda *given: (held,) * (given == (study, "of records")))
    monkeypatch.setattr(publish.published, "republish", kept.append)
    judged = publish.rejudge()
    assert kept == [judged]
    (c8,) = [one for one in judged if one.claim == "C8"]
    assert "a finite MDP" in c8.evidence


def test_each_wider_verdict_follows_the_one_it_widens():
    claims = [one.claim for one in publish.judge_published(published.load())]
    assert claims[claims.index("C7") + 1] == "W7"
    assert claims[claims.index("C9") + 1] == "W9"
    assert claims[-1].startswith("B")


def test_the_main_table_and_the_controls_are_published_as_a_whole_only():
    one = Experiment()
    with pytest.raises(published.Unpublishable, match="with the whole study only"):
        publish.publish_parts({one: None}, {one: "main"})
