"""Records: saved and loaded whole, refused where damaged, and never unpickled."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
from builders import assert_same_numbers, made_records

from nmpcrl.study import DamagedRecords, Experiment, Records
from nmpcrl.study.records import final_cost, load_run

RUN = made_records(Experiment("ES", seed=3, episodes=40, steps=10, evaluate_every=20), 40)


def assert_equal(one, other):
    assert json.dumps(one.experiment) == json.dumps(other.experiment)
    assert one.facts == other.facts
    assert list(one.steps) == list(other.steps)
    assert_same_numbers(one, other)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "folder" / "run.npz"


def test_a_wrong_byte_is_noticed_or_changes_nothing_and_a_first_edition_s_run_is_read(path):
    RUN.save(path)
    assert load_run(path, {})[0].facts == RUN.facts
    content, noticed = path.read_bytes(), 0
    for place in np.random.default_rng(0).integers(len(content), size=100):
        damaged = bytearray(content)
        damaged[place] ^= 85
        path.write_bytes(bytes(damaged))
        try:
            assert_equal(Records.load(path), RUN)
        except DamagedRecords:
            noticed += 1
    assert noticed > 80
    replace(RUN, experiment={**RUN.experiment, "plant": "model"}).save(path)
    assert_equal(Records.load(path), RUN)


FEWER = {name: one for name, one in RUN.steps.items() if name != "theta"}
SHORT = RUN.steps | {"cost": RUN.steps["cost"][1:]}


@pytest.mark.parametrize(
    "wrong",
    [{"steps": FEWER}, {"steps": SHORT}, {"experiment": {**RUN.experiment, "plant": "slips"}}],
    ids=["a column too few", "a short column", "a field of no experiment"],
)
def test_a_file_with_other_columns_or_fields_is_damaged(path, wrong):
    replace(RUN, **wrong).save(path)
    with pytest.raises(DamagedRecords, match=r"run\.npz is damaged, or not a run"):
        Records.load(path)


class Trap:
    """Makes a folder when it is unpickled."""

    def __reduce__(self):
        return os.mkdir, ("sprung",)


@pytest.mark.parametrize(
    ("member", "text"),
    [
        ("about", "{}"),
        ("about", "not json"),
        ("about", '{"experiment": {}}'),
        ("about", '{"experiment": {"layout": "Z"}, "facts": {"solver": "riccati"}}'),
        ("about", None),
        ("steps/theta", None),
    ],
)
def test_a_file_with_another_member_is_damaged_and_no_code_of_it_is_run(
    path, tmp_path, monkeypatch, member, text
):
    monkeypatch.chdir(tmp_path)
    RUN.save(path)
    with np.load(path) as file:
        members = {**file}
    content = np.array(text) if text is not None else np.array([Trap()], dtype=object)
    np.savez(path, **members | {member: content})
    with pytest.raises(DamagedRecords):
        Records.load(path)
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize(
    ("cost", "expected"),
    [
        ([9.0, 3.0, 2.0, 1.0], 2.0),
        ([9.0, 5.0, 3.0, 2.0, 1.0], 2.0),
        ([9.0, 2.0, 1.0], 1.5),  # a short run: theta_init's own rollout says nothing of learning
        ([9.0, 1.0], 1.0),
        ([9.0], np.inf),  # stopped before any rollout of a learned theta
        ([9.0, 3.0, np.inf, 1.0], np.inf),
        ([np.inf, 3.0, 2.0, 1.0], 2.0),
    ],
)
def test_the_final_cost_averages_the_last_rollouts_but_never_the_first(cost, expected):
    assert final_cost(np.array(cost)) == expected
