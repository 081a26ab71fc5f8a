"""What is said of SAC and TD3, on tables that leave no doubt; and what is published of them."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims import agent_published as published
from nmpcrl.claims.agent_published import COLUMNS, order
from nmpcrl.claims.agent_questions import AGENT_QUESTIONS, AGENTS, EVERY, PARTS
from nmpcrl.claims.agent_runs import judged_in
from nmpcrl.claims.agents import answers, course, rows
from nmpcrl.claims.published import Damaged, Unpublishable
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.study.drawn import JUDGE, TUNE


def runs(part, agent, share, there="a", seen=None):
    """All runs of an agent: the shares go down to the last, in layouts seen to another one."""
    found = []
    for place, k in order(part):
        known, points = judged_in(place), PARTS[part].checkpoints
        last = [seen if seen and name in TUNE else share for name in known]
        costs = [[200.0 * one for one in last]] * (len(points) - 2)
        found.append(
            {"part": part, "arm": f"{agent}[turn=0.5]", "place": place, "k": k,
             "initial": [100.0] * len(known),
             "costs": [*costs, [100.0 * one for one in last], [100.0 * one for one in last]],
             "arrived": [there * len(known)] * len(points), "episodes": points[-1],
             "steps": 130 * points[-1], "seconds": 1.5}
        )  # fmt: skip
    return pd.DataFrame(found, columns=[*COLUMNS])


def suite(share=0.95, layouts=(*JUDGE,), part="judge 50"):
    """The best search."""
    return pd.DataFrame(
        [{"part": part, "entry": "Bayes", "layout": one, "initial": 100.0, "best": 90.0,
          "cost": 100.0 * share + k} for one in layouts for k in (-1, 1)]
    )  # fmt: skip


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path))
    return tmp_path


def by(table, compared=None):
    return {one.question: one for one in answers(table, compared)}


def test_of_nothing_nothing_can_be_decided():
    found = by(pd.DataFrame(columns=[*COLUMNS]))
    assert [*found] == [*AGENT_QUESTIONS]
    assert {one.outcome for one in found.values()} == {UNDECIDABLE}


def test_an_agent_matches_where_it_costs_no_more_and_solves_where_it_also_arrives():
    found = by(
        pd.concat([runs("judge", "SAC", 1.0, there="-"), runs("judge", "TD3", 0.9)]), suite()
    )
    assert found["SAC matches in 300 episodes"].outcome == REPRODUCED
    assert found["SAC solves in 300 episodes"].outcome == NOT
    assert found["TD3 solves in 300 episodes"].outcome == REPRODUCED
    assert found["SAC or TD3"].outcome == NOT
    assert found["SAC or the best search"].outcome == NOT
    assert found["TD3 or the best search"].outcome == REPRODUCED
    assert found["TD3 or the best search"].numbers["median ratio"] == pytest.approx(0.9 / 0.95)


def test_in_one_layout_it_is_said_after_how_many_episodes_the_median_matches():
    table = runs("one", "TD3", 0.9)
    found = by(table, suite(0.8, ["A"], "named 50"))
    said = found["TD3 matches in one layout"]
    assert said.outcome == REPRODUCED
    assert said.counts == {"seeds": (4, 4)}
    assert said.numbers["matches first"] == said.numbers["matches from"] == 500
    assert found["TD3 or the best search in one layout"].outcome == NOT
    assert found["SAC matches in one layout"].outcome == UNDECIDABLE


def test_a_match_that_does_not_last_is_no_match_from_then_on():
    table = runs("one", "TD3", 0.9)
    table["costs"] = [[[90.0], *each[1:-1], [101.0]] for each in table.costs]
    one = course(table, "one", "TD3")
    assert one.matched == (25, np.inf)


def test_one_agent_for_all_is_judged_in_what_it_saw_and_in_what_it_did_not():
    found = by(runs("all", "SAC", 1.1, seen=0.9), suite())
    assert found["SAC matches over the 60"].outcome == REPRODUCED
    assert found["SAC matches over the 60"].counts == {"layouts": (60, 60)}
    assert found["SAC matches on the 120"].outcome == NOT
    assert found["SAC matches on the 120"].counts == {"layouts": (0, 120)}
    assert found["SAC or the best search on the 120"].counts == {"layouts": (0, 120)}
    assert np.isinf(found["SAC matches on the 120"].numbers["matches first"])


def test_between_all_and_none_a_question_is_answered_in_part():
    table = runs("judge", "SAC", 0.9)
    table["costs"] = [
        each if i % 2 else [*each[:-1], [130.0]] for i, each in enumerate(table.costs)
    ]
    assert by(table)["SAC matches in 300 episodes"].outcome == PARTLY


def test_an_agent_has_a_row_of_the_suite_by_the_share_of_the_possible_gain():
    table = pd.concat([runs("judge", "SAC", 0.95), runs("judge", "TD3", 1.2, there="-")])
    first, second = rows(table, suite())
    assert (first.entry, first.name, first.rollouts) == ("SAC", "SAC[turn=0.5]", 300)
    assert first.gain.value == pytest.approx(0.5)
    assert first.solved.value == 1
    assert second.gain.value == pytest.approx(-2)
    assert second.solved.value == 0
    assert not first.disqualified


def test_what_is_read_is_what_was_published_and_agents_come_beside_it():
    one, two = runs("judge", "SAC", 0.98765), runs("all", "TD3", 1.1)
    published.extend(one)
    published.extend(pd.concat([one, two]))
    both = pd.concat([one, two], ignore_index=True)
    pd.testing.assert_frame_equal(published.load().table, both, check_dtype=False)
    assert len(published.load().about["made"]) == 2


def test_what_is_not_whole_is_not_published_and_what_was_changed_is_not_read():
    with pytest.raises(Unpublishable, match="has 5 of 6 runs of the part 'judge'"):
        published.extend(runs("judge", "SAC", 0.9)[1:])
    with pytest.raises(Damaged, match="nmpcrl agents --publish"):
        published.load()
    path = published.extend(runs("judge", "SAC", 0.98765))
    path.write_text(path.read_text().replace("98.765", "98.764", 1))
    with pytest.raises(Damaged, match="it is not what was written"):
        published.load()


def test_all_of_it_takes_less_than_a_fifth_of_a_megabyte():
    rng = np.random.default_rng(0)
    whole = pd.concat([runs(part, agent, 1.0) for part in PARTS if part != "tune"
                       for agent in AGENTS])  # fmt: skip
    whole["initial"] = [rng.uniform(3e3, 5e3, len(one)).tolist() for one in whole.initial]
    whole["costs"] = [rng.uniform(3e3, 5e3, np.shape(one)).tolist() for one in whole.costs]
    assert EVERY in {*whole.place}
    assert published.extend(whole).stat().st_size < 2e5
