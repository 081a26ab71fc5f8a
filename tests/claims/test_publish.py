"""Times are published if they decide, and parts beside the whole study."""

import pandas as pd
import pytest

from nmpcrl.claims import publish, published
from nmpcrl.claims.verdict import PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.claims.wider_claims import WIDER_THAN
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
def test_times_are_published_if_they_decide_all_claims_about_time(monkeypatch, width, outcomes):
    written, taken = [], timings(width)
    monkeypatch.setattr(publish, "time_learners_repeatedly", lambda: taken)
    monkeypatch.setattr(publish.published, "republish", written.append)
    judged = publish.publish_timing()
    assert [verdict.outcome for verdict in judged] == outcomes
    assert len(written) == (UNDECIDABLE not in outcomes)


def test_the_main_table_and_the_controls_are_published_as_a_whole_only():
    with pytest.raises(published.Unpublishable, match="with the whole study only"):
        publish.publish_parts({Experiment(): None}, {Experiment(): "main"})


def test_each_wider_verdict_follows_the_one_it_widens_and_ours_are_last():
    claims = [one.claim for one in published.load().verdicts]
    for wider, narrow in WIDER_THAN.items():
        assert claims[claims.index(narrow) + 1] == wider
    assert [one[0] for one in claims[-4:]] == ["B"] * 4
    assert published.Published().verdicts == ()
