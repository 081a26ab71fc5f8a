"""A richer terminal cost is asked of costs that there are."""

from nmpcrl.claims.terminal_questions import ARMS, TERMINAL
from nmpcrl.study.population import JUDGE
from nmpcrl.study.world import TERMINALS


def test_each_terminal_cost_is_learned_in_the_layouts_in_which_horizons_were_compared():
    assert ARMS == TERMINALS
    assert {*TERMINAL.places} < {*JUDGE}
    assert {len(TERMINAL.runs(arm)) for arm in ARMS} == {60}
