"""What is asked of a richer terminal cost: of costs that there are, and not moved since."""

from pathlib import Path

from fixed_questions import assert_older, assert_unmoved

from nmpcrl.claims import terminal_questions
from nmpcrl.claims.terminal_questions import ARMS, TERMINAL, TERMINAL_QUESTIONS
from nmpcrl.study.population import JUDGE
from nmpcrl.study.world import TERMINALS

FILE = Path(terminal_questions.__file__)


def test_the_questions_are_those_of_the_commit_that_added_them():
    assert_unmoved(FILE)


def test_the_questions_are_older_than_the_runs_that_are_published():
    assert_older(FILE, "book/published/worlds.json", '"terminal"')


def test_each_terminal_cost_is_learned_in_the_layouts_in_which_horizons_were_compared():
    assert ARMS == TERMINALS
    assert {*TERMINAL.places} < {*JUDGE}
    assert {len(TERMINAL.runs(arm)) for arm in ARMS} == {60}


def test_a_question_says_how_it_is_decided():
    for one in TERMINAL_QUESTIONS.values():
        assert one.question.endswith("?")
        assert all((one.asked_of, one.measured, one.border))
