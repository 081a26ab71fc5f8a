"""Settings of SAC and TD3: tuned before they are judged. `tests/golden` holds the answers."""

import pandas as pd
import pytest

from nmpcrl.studies.agents import AGENTS, PARTS, SAC_AND_TD3, SETTINGS, tuned
from nmpcrl.studies.agents_run import EVERY, judged_in, trained_in
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.refusal import Refusal


def test_an_agent_is_judged_with_the_setting_that_costs_least_and_not_before_it_is_known():
    tuning = [
        {"part": "tune", "arm": str(AGENTS["SAC"].with_settings(**setting)), "place": place,
         "initial": [100.0], "costs": [[100.0 + abs(i - 2)]]}
        for i, setting in enumerate(SETTINGS["SAC"]) for place in PARTS["tune"].places
    ]  # fmt: skip
    assert str(tuned(pd.DataFrame(tuning), "SAC")) == "SAC[gradient=0.5,width=128]"
    with pytest.raises(Refusal, match="the part 'tune' comes first"):
        tuned(pd.DataFrame(tuning[1:]), "SAC")


def test_the_published_settings_are_those_of_the_published_tuning():
    table = SAC_AND_TD3.table()
    for part in PARTS:
        assert {*PARTS[part].settings(table)} == {*table[table.part == part].arm}


def test_one_agent_for_all_is_judged_in_layouts_that_it_never_saw():
    assert {*trained_in(EVERY)} == {*TUNE}
    assert {*judged_in(EVERY)} == {*TUNE, *JUDGE}
    assert {*judged_in("J001")} == {*trained_in("J001")} == {"J001"}
