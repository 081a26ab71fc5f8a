"""What is asked of SAC and TD3 is complete."""

from nmpcrl.analysis import agents
from nmpcrl.claims import remedy_questions
from nmpcrl.claims.agent_questions import AGENTS, EVERY, LONG, PARTS, SEARCH, SEARCHED, SETTINGS
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, TUNE


def test_each_agent_has_as_many_settings_as_a_remedy_the_one_it_ships_with_first():
    assert AGENTS == agents.AGENTS
    for agent in AGENTS:
        names = [str(agents.ENTRIES[agent].with_settings(**setting)) for setting in SETTINGS[agent]]
        assert names[0] == agent
        assert len({*names}) == remedy_questions.RUNS_OF_TUNING


def test_what_is_tuned_on_is_not_judged_on_and_is_there():
    assert {*PARTS["tune"].places} <= {*TUNE}
    assert {*PARTS["judge"].places} <= {*JUDGE}
    assert {*PARTS["one"].places} <= {*paper.LAYOUTS}
    assert PARTS["all"].places == (EVERY,)
    assert {*LONG} < {*PARTS}


def test_checkpoints_rise_and_the_last_is_the_budget():
    for part in PARTS.values():
        assert [*part.checkpoints] == sorted({*part.checkpoints})
        assert part.budget == part.checkpoints[-1]


def test_what_agents_are_compared_with_is_in_the_comparison_of_remedies():
    assert SEARCH in remedy_questions.SETTINGS
    judged, named = (remedy_questions.PARTS[part] for part in SEARCHED)
    assert judged.budget == named.budget == 50
    assert {*PARTS["judge"].places} <= {*judged.layouts}
    assert {*PARTS["one"].places} <= {*named.layouts}
