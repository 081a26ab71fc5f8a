"""The design of the population's runs: the unit is a layout, and every run has its control arm."""

import pytest

from nmpcrl.study import population_design as design
from nmpcrl.study.drawn import JUDGE, LAYOUTS
from nmpcrl.study.experiment import MAIN, frozen_arm
from nmpcrl.study.layouts import screen
from nmpcrl.study.limits import seconds_of


def test_no_two_layouts_share_a_seed():
    given = [seed for name in LAYOUTS for seed in design.seeds(name)]
    assert len(given) == len({*given}) == 2 * len(LAYOUTS)


def test_every_learner_of_the_main_table_is_judged_on_120_layouts_in_two_readings_with_two_seeds():
    parts = ("judge", "judge imitating", "judge again")
    judged = [one for part in parts for one in design.arms()[part]]
    assert {one.learner for one in judged} == {*MAIN}
    assert len(judged) == len({*judged}) == 6 * 120 * 2 * 2


def test_every_run_has_its_frozen_arm():
    whole = design.whole_population()
    assert all(frozen_arm(one) in whole for one in whole)


def test_a_run_of_another_horizon_or_step_size_has_its_counterpart_among_the_judged():
    whole = design.whole_population()
    judged = {
        (one.learner, one.layout, one.decay, one.seed)
        for one, part in whole.items()
        if part.startswith("judge")
    }
    others = [one for one, part in whole.items() if part[0] in "Na"]
    assert {(one.learner, one.layout, one.decay, one.seed) for one in others} <= judged


@pytest.mark.slow
def test_the_compared_layouts_are_the_first_of_either_kind():
    kinds = {name: screen(centres).closing for name, centres in JUDGE.items()}
    closing = [name for name in kinds if kinds[name]][:15]
    others = [name for name in kinds if not kinds[name]][:15]
    assert tuple(sorted(closing + others)) == design.COMPARED


def test_the_runs_take_less_than_five_hours_on_two_cores():
    assert sum(map(seconds_of, design.whole_population())) / 3600 / 2 < 5
