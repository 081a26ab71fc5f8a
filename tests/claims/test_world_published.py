"""Worlds that change, published: what is read is what was written, arm by arm."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import world_published as published
from nmpcrl.claims.published import Damaged, Unpublishable
from nmpcrl.claims.world_questions import PARTS
from nmpcrl.claims.world_runs import COLUMNS


def runs(part, arm, cost=0.98765):
    """All runs of an arm; the first fails, and the last was noticed."""
    found = [
        {"part": part, "arm": arm, "place": place, "k": k, "cost": cost, "inside": 2,
         "collisions": 1, "arrived": True, "series": [cost, 1.0], "events": [], "seconds": 1.5}
        for place, k in PARTS[part].runs("remedy" if arm.startswith("remedy") else arm)
    ]  # fmt: skip
    found[0] |= {"cost": np.inf, "arrived": False, "series": [np.inf]}
    found[-1] |= {"events": [54, 104]}
    return pd.DataFrame(found, columns=[*COLUMNS])


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path))
    return tmp_path


def test_what_is_read_is_what_was_published_and_parts_come_beside_it():
    one, two = runs("once", "ES told plain"), runs("once", "remedy undone-GN-J")
    published.extend(one)
    published.extend(pd.concat([one, two]))
    both = pd.concat([one, two], ignore_index=True)
    pd.testing.assert_frame_equal(published.load().table, both, check_dtype=False)
    assert len(published.load().about["made"]) == 2


def test_what_is_published_is_not_published_otherwise_or_in_part():
    published.extend(runs("gradient", "0.05"))
    with pytest.raises(Unpublishable, match=r"0\.05 is published already in the part 'gradient'"):
        published.extend(runs("gradient", "0.05", cost=0.5))
    with pytest.raises(
        Unpublishable, match="nothing of what was run in worlds that change is whole and new"
    ):
        published.extend(runs("gradient", "0.05"))
    with pytest.raises(Unpublishable, match=r"0\.1 has 19 of 20 runs of the part 'gradient'"):
        published.extend(runs("gradient", "0.1")[1:])


def test_what_is_missing_or_changed_is_refused(place):
    with pytest.raises(Damaged, match="nmpcrl world --publish"):
        published.load()
    path = published.extend(runs("gradient", "0.05"))
    path.write_text(path.read_text().replace("0.98765", "0.98764", 1))
    with pytest.raises(Damaged, match="it is not what was written"):
        published.load()


def test_all_of_it_takes_less_than_three_megabytes():
    rng = np.random.default_rng(0)
    whole = pd.concat([runs(part, arm) for part, one in PARTS.items() for arm in one.arms])
    length = {"carry": 120, "model": 16, "once": 60, "every 50": 60, "random": 60}
    whole["series"] = [rng.uniform(1e3, 1e4, length.get(one, 1)).tolist() for one in whole.part]
    assert published.extend(whole).stat().st_size < 1.5e6
