"""The comparison of remedies published: what is read is what was written, entry by entry."""

import json

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import remedy_published as published
from nmpcrl.claims.published import Damaged, Unpublishable
from nmpcrl.claims.remedies import COLUMNS, advice, answers
from nmpcrl.claims.remedy_questions import PARTS, SETTINGS


def runs(entry, part, cost=3456.789, name=None):
    """All runs of an entry in a part; the first fails, the second does not arrive."""
    one = PARTS[part]
    found = [
        {
            "part": part, "entry": entry, "name": name or entry, "layout": layout, "k": k,
            "initial": 4000.0, "best": 3000.0, "cost": cost, "arrived": True,
            "episodes": one.budget, "over": False, "seconds": 1.5,
        }
        for layout in one.layouts_of(entry)
        for k in range(one.seeds)
    ]  # fmt: skip
    found[0]["cost"], found[1]["arrived"], found[2]["episodes"] = np.inf, False, 3
    found[3]["over"] = True
    return pd.DataFrame(found, columns=[*COLUMNS])


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path))
    return tmp_path


def both():
    tuned = runs("ES", "tune", name="ES[alpha=3e-07]")
    return pd.concat([tuned, runs("ES", "judge 50"), runs("grid", "judge 50")], ignore_index=True)


def test_what_is_read_is_what_was_published():
    published.extend(both())
    pd.testing.assert_frame_equal(
        published.load().table, both(), check_dtype=False, rtol=1e-6, check_like=True
    )
    assert len(published.load().about["made"]) == 1


def test_entries_are_put_beside_those_that_are_there_and_say_the_same(place, monkeypatch):
    published.extend(both())
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(place / "parts"))
    whole = both()
    for entry in ("ES", "grid"):
        published.extend(whole[whole.entry == entry])
    parts = published.load()
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(place))
    pd.testing.assert_frame_equal(published.load().table, parts.table)
    assert advice(parts.table) == advice(published.load().table)
    assert [one.counts for one in answers(parts.table)]
    assert len(parts.about["made"]) == 2


def test_what_is_there_stays_and_further_parts_come_beside_it(place):
    published.extend(runs("grid", "judge 50"))
    before = json.loads((place / published.FILE).read_text())["entries"]["grid"]["judge 50"]
    published.extend(pd.concat([runs("grid", "judge 50"), runs("grid", "named 50")]))
    after = json.loads((place / published.FILE).read_text())["entries"]["grid"]
    assert after["judge 50"] == before
    assert [*after] == ["judge 50", "named 50"]


def test_what_is_published_is_not_published_otherwise():
    published.extend(runs("grid", "judge 50"))
    with pytest.raises(Unpublishable, match="grid is published already in the part 'judge 50', o"):
        published.extend(runs("grid", "judge 50", cost=3000.0))
    with pytest.raises(Unpublishable, match="nothing of the comparison is whole and new"):
        published.extend(runs("grid", "judge 50"))


def test_an_entry_is_judged_with_one_setting_only():
    published.extend(runs("ES", "judge 50"))
    with pytest.raises(Unpublishable, match="ES is published already in 'judge 50', as ES"):
        published.extend(runs("ES", "judge 50", name="ES[alpha=3e-07]"))


def test_a_part_that_is_not_whole_is_refused():
    with pytest.raises(Unpublishable, match="grid has 239 of 240 runs of the part 'judge 50'"):
        published.extend(runs("grid", "judge 50")[1:])


def test_another_yardstick_is_refused():
    published.extend(runs("grid", "judge 50"))
    with pytest.raises(Unpublishable, match="layout J001 is published with other costs"):
        published.extend(runs("ES", "judge 50").assign(best=2900.0))


def test_what_is_missing_or_changed_is_refused(place):
    with pytest.raises(Damaged, match="nmpcrl remedies --publish"):
        published.load()
    published.extend(both())
    text = (place / published.FILE).read_text()
    (place / published.FILE).write_text(text.replace("3456.789", "3456.788", 1))
    with pytest.raises(Damaged, match="it is not what was written"):
        published.load()


def test_all_that_is_compared_takes_less_than_two_megabytes(place):
    rng = np.random.default_rng(0)
    found = [
        runs(entry, part, name=f"{entry}[a={k}]")
        for entry in SETTINGS
        for part in PARTS
        if PARTS[part].layouts_of(entry)
        for k in range(4 if part == "tune" else 1)
    ]
    whole = pd.concat(found, ignore_index=True)
    whole["cost"] = rng.uniform(3000, 4000, len(whole))
    whole["episodes"] = rng.integers(10, 300, len(whole))
    published.extend(whole)
    assert (place / published.FILE).stat().st_size < 0.5e6
