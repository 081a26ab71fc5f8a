"""The paper's whole picture, sought in what is published and in what is made up."""

import pandas as pd
import pytest

from nmpcrl.claims import population_published, published, whole_picture
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.verdict import NOT, REPRODUCED, UNDECIDABLE
from nmpcrl.claims.whole_picture import PICTURE
from nmpcrl.study.design import MAIN_TABLE, VARIANTS


@pytest.fixture(scope="module")
def six():
    return published.load()


@pytest.fixture(scope="module")
def tried():
    return population_published.load().tried


def test_it_is_sought_in_a_to_f_and_in_whatever_was_varied_there(tried):
    there = tried[tried.layout.isin(list("ABCDEF"))]
    cells = there[there.setting == MAIN_TABLE]
    assert {*zip(cells.layout, cells.decay, strict=True)} == {
        (layout, decay) for layout in "ABCDEF" for decay in ("step", "episode")
    }
    assert {*there.setting} == {MAIN_TABLE, *VARIANTS} - {"controls"}
    assert not tried.duplicated(["setting", "layout", "decay"]).any()


def test_a_share_is_that_of_the_claims_own_answers(six, tried):
    main = six.table[six.table.variant == MAIN_TABLE]
    found = tried[tried.setting == MAIN_TABLE].set_index(["layout", "decay"])
    for name in PICTURE:
        claim = BY_RUNS[name]
        answers = claim.answers(claim.measure(main, six.paths)).dropna().astype(bool)
        for cell in (("A", "step"), ("D", "episode")):
            assert found.loc[cell, name] == answers.xs(cell, level=["layout", "decay"]).mean()


def test_a_learner_that_a_variant_leaves_alone_stands_in_it_as_in_the_main_table(tried):
    cell = tried[(tried.layout == "D") & (tried.decay == "step")].set_index("setting")
    assert cell.loc["greedy", "C5"] == cell.loc[MAIN_TABLE, "C5"]
    assert cell.loc["greedy", "C1"] != cell.loc[MAIN_TABLE, "C1"]


def test_the_nearest_comes_first_and_only_a_whole_one_confirms(tried):
    assert tried.whole.is_monotonic_decreasing
    assert [*tried.whole] == [*(tried[[*PICTURE]] == 1).sum(axis=1)]
    some = pd.DataFrame({"whole": [3, 1]})
    assert whole_picture.answer(some).outcome == NOT
    assert whole_picture.answer(some).numbers == {"tried": 2.0, "most": 3.0}
    found = whole_picture.answer(pd.DataFrame({"whole": [4, 1]}))
    assert (found.outcome, found.beside) == (REPRODUCED, {"settings": (1, 2)})
    assert found.words == "found by search"
    assert whole_picture.answer(some[:0]).outcome == UNDECIDABLE
