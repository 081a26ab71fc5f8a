"""Both editions side by side: the first is frozen, today's is computed from what is published."""

from hashlib import sha256

import pytest

from nmpcrl.report import editions
from nmpcrl.report.editions import Line
from nmpcrl.studies.population import POPULATION
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.studies.worlds import WORLDS
from nmpcrl.study import published

FROZEN = "480ca5d46efbed0a081dc1d96476c374cc5166ed52d4498ea5e677c646e149e9"
ROLLOUT = 1e-6  # relative, of rollouts by other code


@pytest.fixture(scope="module")
def both():
    return editions.compared(editions.found())


def test_the_first_edition_never_changes_and_each_verdict_and_answer_has_a_line():
    text = (published.folder() / editions.FILE).read_text("utf-8")
    assert sha256(text.encode()).hexdigest() == FROZEN
    names = {(one.group, one.name) for one in editions.first() if one.outcome}
    claims = {name for group, name in names if "claims" in group}
    assert claims == {*(f"C{i}" for i in range(1, 10)), "W7", "W9", *(f"B{i}" for i in range(1, 5))}
    investigations = {"Drawn layouts": POPULATION, "Remedies": REMEDIES, "Changing worlds": WORLDS}
    for group, one in investigations.items():
        assert {(group, name) for name in one.asked} <= names


@pytest.mark.slow
def test_what_rests_on_rows_of_the_first_edition_alone_is_the_same_today(both):
    """A group is left out as soon as the manifest says that one of its parts was made anew."""
    old = [
        group for group, parts in editions.GROUPS.items() if not any(map(editions.is_anew, parts))
    ]
    for one in both[both.group.isin(old)].itertuples():
        assert one.stands is not False
        for name in ("text", "expected", "outcome", "counts"):
            assert getattr(one.today, name) == getattr(one.first, name), one.name
        for name in ("value", "low", "high"):
            then = getattr(one.first, name)
            known = None if then is None else pytest.approx(then, rel=ROLLOUT, nan_ok=True)
            assert getattr(one.today, name) == known, one.name


@pytest.mark.slow
def test_every_line_has_a_group_and_is_counted_once(both):
    assert {*both.group} == {*editions.GROUPS}
    assert not both.duplicated(["group", "name"]).any()
    counts = editions.summary(both)
    assert counts.outcomes.sum() == sum(bool(one.outcome) for one in editions.first())
    pages = "".join(editions.table(both, group) for group in editions.GROUPS)
    assert pages.count("<tr>") == len(both)


@pytest.mark.parametrize(
    ("one", "other", "stands"),
    [
        (Line("", "", outcome="confirmed"), Line("", "", outcome="confirmed", value=9.0), True),
        (Line("", "", outcome="confirmed"), Line("", "", outcome="contradicted"), False),
        (Line("", "", outcome="confirmed"), Line("", ""), False),  # it is asked no more
        (Line("", "", "", "", "", 0.5, 0.4, 0.6), Line("", "", "", "", "", 0.7, 0.6, 0.8), True),
        (Line("", "", "", "", "", 0.5, 0.4, 0.6), Line("", "", "", "", "", 0.7, 0.65, 0.8), False),
        (Line("", "", value=1.0), Line("", "", value=1.0), None),
        (Line("", "", "", "", "", 0.5, 0.4, 0.6), Line("", "", value=0.5), None),
    ],
)
def test_an_outcome_stands_by_its_word_and_a_number_by_its_interval(one, other, stands):
    assert one.stands(other) is stands


def test_a_part_made_anew_and_what_turned_are_counted(monkeypatch):
    monkeypatch.setattr(editions, "is_anew", lambda part: part == editions.MAIN)
    now = {(one.group, one.name): one for one in editions.first()}
    first, second = (("The paper's claims", name) for name in ("C1", "C2"))
    now.pop(second)
    today = [*(now | {first: Line(*first, outcome="turned")}).values()]
    again = editions.compared(today)
    turned = again[again.stands.eq(False)]
    assert [*zip(turned.group, turned.name, strict=True)] == [first, second]
    before = editions.summary(editions.compared(editions.first()))
    counts = editions.summary(again)
    changed = before.standing - counts.standing
    assert changed[changed != 0].to_dict() == {"The paper's claims": 2}
    assert counts.anew.to_dict()["Changing worlds"] == 0 < counts.anew["The paper's claims"] == 1
    assert (editions.parts_table().edition == "second").sum() == 1
    assert editions.table(again, "The paper's claims").count(">no</td>") == 2
