"""An investigation makes each row once, loses none, and publishes what is complete."""

import json
import os
import time
from dataclasses import replace

import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, REPRODUCED, UNDECIDABLE
from nmpcrl.studies.investigation import NAMES, Answer, Investigation, Part, Question, lower, means
from nmpcrl.study import published
from nmpcrl.study.files import folder
from nmpcrl.study.provenance import EPOCHS
from nmpcrl.study.published import Damaged, Unpublishable
from nmpcrl.study.refusal import Refusal

CALLS = []


def run(setting, place, episodes, seed):
    CALLS.append((setting, place, seed))
    return {"cost": setting + seed / 3 + len(place), "series": [1.0, float("inf")], "arrived": True}


def best(table):
    if table[table.part == "tune"].empty:
        raise Refusal("the arm depends on the part 'tune'")
    return {"best": table[table.part == "tune"].groupby("arm").cost.mean().min()}


PARTS = {
    "tune": Part(run, {"low": 1.0, "high": 2.0}, ("a", "b"), 10, seeds=2, deterministic=("low",)),
    "judge": Part(run, best, tuple("abcdefghij"), 10, first={"best": 3}),
}
QUESTIONS = (Question("low is low", "Is it?", NOT, lower("tune", "low", "high")),)


def toy(**changes):
    fields = {"name": "toy", "parts": PARTS, "questions": QUESTIONS, "digits": 3}
    return Investigation(**fields | {"seed": lambda place, k: 10 * ord(place) + k} | changes)


@pytest.fixture(autouse=True)
def folders(tmp_path, monkeypatch, trains_here):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    CALLS.clear()
    return tmp_path


def test_every_row_is_made_once_in_order_with_the_same_seeds_for_all_arms():
    with pytest.raises(Refusal, match="depends on the part 'tune'"):
        toy().complete(["judge"], workers=1)
    table = toy().complete(workers=1)
    assert table.groupby("part", sort=False).size().to_dict() == {"tune": 6, "judge": 3}
    again = toy().complete(workers=1)
    pd.testing.assert_frame_equal(again, table)
    low, high = (table[table.arm == arm].query("k == 0") for arm in ("low", "high"))
    assert (high.cost.to_numpy() - low.cost.to_numpy() == 1).all()


def test_what_changes_a_number_changes_the_key_and_nothing_else_does():
    one = next(iter(toy().conditions("tune")))
    longer = {"tune": Part(run, {"low": 1.0}, "ab", 11)}
    assert toy().key(one) == toy(questions=()).key(one)
    others = (toy(name="other"), toy(epoch=2), toy(parts=longer), toy(libraries=("cma",)))
    assert len({toy().key(one), *(each.key(one) for each in others)}) == 5


def noted(setting, place, episodes, seed):
    with (folder().parent / "made").open("a") as file:
        file.write(f"{setting} {place} {seed}\n")
    time.sleep(0.01)
    return run(setting, place, episodes, seed)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork")
def test_two_processes_at_one_investigation_make_each_row_once():
    one = toy(parts={"all": Part(noted, {"low": 1.0, "high": 2.0}, tuple("abcdefghij"), 10)})
    other = os.fork()
    table = one.complete(workers=1)
    if not other:
        os._exit(len(table) != 20)
    assert os.waitpid(other, 0)[1] == 0
    assert len(table) == len(one.made()) == 20
    made = (folder().parent / "made").read_text().splitlines()
    assert sorted(made) == sorted({*made})
    assert len(made) == 20


def of_other_sources(text):
    lines = [json.loads(line) for line in text.splitlines() if line]
    return "\n".join(json.dumps([key, "other", *row]) for key, _, *row in lines)


@pytest.mark.parametrize(("edit", "missing"), [(lambda text: text[:-9], 1), (of_other_sources, 6)])
def test_a_line_that_was_cut_off_or_has_other_sources_is_made_again(edit, missing):
    toy().complete(["tune"], workers=1)
    path = toy().log
    path.write_text(edit(path.read_text()))
    assert len(toy().missing("tune")) == missing
    assert len(toy().complete(["tune"], workers=1)) == 6


def test_complete_arms_are_published_rounded_and_read_as_they_were_written(folders):
    toy().complete(["tune"], workers=1)
    toy().publish()
    table = toy().table()
    assert [*table.arm] == ["low"] * 2 + ["high"] * 4
    assert table.cost[0] == float(f"{1 + 970 / 3 + 1:.3g}")
    assert table.series[0] == [1.0, float("inf")]
    toy().complete(workers=1)
    assert toy().unregistered == 0  # for none says when it was
    toy(registered="abc").publish()
    pd.testing.assert_frame_equal(toy().table()[:6], table)
    about = published.about("toy")
    assert [one["rows"] for one in about["batches"]] == [{"tune": 6}, {"judge": 3}]
    assert about["registered"] == ""  # the first rows were made before


def changed(**fields):
    """The parts with another field of the first one."""
    return PARTS | {"tune": replace(PARTS["tune"], **fields)}


@pytest.mark.parametrize(
    ("now", "left"),
    [
        ({"epoch": 2}, 0),
        ({"source": "an edited file"}, 0),
        ({"parts": changed(episodes=11)}, 0),
        ({"parts": changed(places=("b", "c"))}, 3),
        ({"parts": changed(arms={"other": 1.0, "high": 2.0})}, 4),
        ({"parts": {"renamed": PARTS["tune"]}}, 0),
    ],
)
def test_rows_that_are_asked_no_more_are_neither_judged_nor_published(now, left):
    toy().complete(["tune"], workers=1)
    one = toy(**now)
    assert len(one.made()) == left
    part = next(iter(one.parts))
    one.complete([part], workers=1)
    one.publish()
    rows = one.table()[NAMES].itertuples(index=False, name=None)
    assert sorted(rows) == sorted(one.conditions(part))


def test_a_table_is_registered_by_the_commit_before_its_first_row():
    toy().complete(["tune"], workers=1)
    late = toy(registered="abc")
    assert late.unregistered == 6
    late.publish()
    assert published.about("toy")["registered"] == ""
    early = toy(name="early", registered="abc")
    early.complete(["tune"], workers=1)
    early.publish()
    toy(name="early", registered="later").complete(workers=1)
    toy(name="early", registered="later").publish()
    assert published.about("early")["registered"] == "abc"


@pytest.mark.parametrize(
    ("answer", "said"), [(lambda _: True, "gives True and no"), (lambda _: 1 / 0, "division by")]
)
def test_a_question_that_fails_is_named(answer, said):
    with pytest.raises(Refusal, match=f"the question 'odd' .*{said}"):
        toy(questions=(Question("odd", "?", NOT, answer),)).answers(pd.DataFrame())


def with_paths(setting, place, episodes, seed):
    row = run(setting, place, episodes, seed) | {"seconds": 7.0}
    return row if place == "a" else row | {"path": [[seed, 1], [2, -3]]}


def test_rows_may_have_lists_that_are_published_apart_and_a_time_of_their_own():
    places = lambda: [("b", 2), ("a", 1)]  # noqa: E731
    grid = Part(with_paths, {"one": 1.0}, ("a", "b"), 10, begin=1)
    parts = {"grid": grid, "listed": Part(with_paths, {"one": 1.0}, (), 10, at=places)}
    made = toy(parts=parts, arrays=("path",), evidence=lambda table: table[table.k == 1])
    assert [*made.conditions("grid")] == [("grid", "one", "a", 1), ("grid", "one", "b", 1)]
    for part in parts:
        made.complete([part], workers=1)
        made.publish()
    table = made.table()
    assert [*zip(table.place, table.k, strict=True)] == [("a", 1), ("b", 1), ("b", 2), ("a", 1)]
    assert "path" not in table
    assert {*table.seconds} == {7.0}
    assert published.arrays("toy")["path"].tolist() == [[[981, 1], [2, -3]], [[982, 1], [2, -3]]]
    with pytest.raises(Unpublishable, match="no arm of toy is complete and new"):
        made.publish()
    asked = Question("rows", "How many?", NOT, lambda rows: Answer(NOT, {"rows": (0, len(rows))}))
    found = toy(questions=(asked,), evidence=made.evidence).answers(table)
    assert found["rows"].counts == {"rows": (0, 3)}


def test_what_is_published_is_neither_changed_nor_published_twice_nor_in_part():
    toy().complete(["tune"], workers=1)
    toy().publish()
    with pytest.raises(Unpublishable, match="no arm of toy is complete and new"):
        toy().publish()
    path = toy().log
    path.write_text(path.read_text().replace('"cost": ', '"cost": 9'))
    with pytest.raises(Unpublishable, match="low of the part 'tune' is published with other"):
        toy().publish()
    (published.folder() / "manifest.json").unlink()
    published._manifest.cache_clear()
    with pytest.raises(Unpublishable, match=r"toy\.csv is there, and not in manifest\.json"):
        toy().publish()


def test_a_part_of_earlier_epochs_is_replaced_as_a_whole_and_the_others_stay():
    parts = {
        "tune": Part(with_paths, {"low": 1.0, "high": 2.0}, ("a", "b"), 10),
        "judge": Part(with_paths, best, ("b", "a", "c"), 10),
    }
    made = toy(parts=parts, arrays=("path",))
    made.complete(workers=1)
    made.publish()
    first, paths = made.table(), published.arrays("toy")["path"]
    later = toy(parts=parts, arrays=("path",), epochs={**EPOCHS, "control": 99})
    assert [later.is_current(part) for part in parts] == [False, False]
    assert later.known().empty
    assert later.price("tune") == (4, 4, 4 * 7.0)  # of the earlier rows
    assert later.price("judge") == (3, 3, 3 * 7.0)  # by the published arms
    with pytest.raises(Refusal, match="depends on the part 'tune'"):
        later.conditions("judge")
    later.complete(["tune"], workers=1)
    whole = later.log.read_text()
    later.log.write_text(whole[: whole.rindex("\n")])
    with pytest.raises(Unpublishable, match="no arm of toy is complete and new"):
        later.publish()  # an arm of the part is missing
    later.log.write_text(whole.replace('"path": [[', '"path": [[1000'))
    later.publish()
    pd.testing.assert_frame_equal(later.table(), first)
    now = published.arrays("toy")["path"]
    assert (now[2:] == paths[2:]).all()
    assert (now[:2, 0, 0] == [int(f"1000{one}") for one in paths[:2, 0, 0]]).all()
    assert [later.is_current(part) for part in parts] == [True, False]
    batches = published.about("toy")["batches"]
    assert [one["rows"] for one in batches] == [{"judge": 3}, {"tune": 4}]
    assert [one["epochs"]["control"] for one in batches] == [EPOCHS["control"], 99]
    assert [*later.conditions("judge")] == [("judge", "best", place, 0) for place in "bac"]


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_every_changed_byte_is_noticed_before_a_number_is_shown(folders, suffix):
    table = pd.DataFrame({"a": [1.5, float("inf")], "b": [[1], []], "c": ["", "x"]})
    published.write("data", table, {"x": table.a.to_numpy()}, batch={})
    pd.testing.assert_frame_equal(published.read("data"), table)
    for path in (published.folder() / f"data{suffix}", published.folder() / "manifest.json"):
        content = path.read_bytes()
        for i in range(0, len(content), 1 + len(content) // 60):
            path.write_bytes(content[:i] + bytes([content[i] ^ 1]) + content[i + 1 :])
            for cached in (published._manifest, published._table, published._arrays):
                cached.cache_clear()
            with pytest.raises(Damaged):
                published.read("data"), published.arrays("data")
        path.write_bytes(content)


def test_answers_come_with_their_question_and_places_without_a_row_are_skipped():
    toy().complete(["tune"], workers=1)
    answer = toy().answers(toy().made())["low is low"]
    assert answer == Answer(UNDECIDABLE, {"layouts": (2, 2)}, question="low is low")
    rows = [
        ("p", arm, f"{i}", 0, i + (arm == "b")) for arm in "ab" for i in range(10 + (arm == "a"))
    ]
    table = pd.DataFrame(rows, columns=["part", "arm", "place", "k", "cost"])
    assert lower("p", "a", "b")(table) == Answer(REPRODUCED, {"layouts": (10, 10)})
    assert means(table, "p").b.isna().sum() == 1
