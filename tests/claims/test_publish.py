"""What rests on time alone is published anew, unless the machine was too busy to say."""

import pandas as pd
import pytest

from nmpcrl.claims import publish
from nmpcrl.claims.rule import PARTLY, REPRODUCED, UNDECIDABLE


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
    monkeypatch.setattr(publish, "time_learners_afresh", lambda: taken)
    monkeypatch.setattr(publish.published, "republish", lambda *both: kept.append(both))
    judged = publish.publish_timing()
    assert [verdict.claim for verdict in judged] == ["C3", "C4"]
    assert [verdict.outcome for verdict in judged] == outcomes
    assert kept == ([(judged, taken)] if UNDECIDABLE not in outcomes else [])
