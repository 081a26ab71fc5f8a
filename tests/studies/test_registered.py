"""Parts, thresholds and questions are those that were committed before the first row was made."""

import pytest
from fixed_questions import git
from registered import INVESTIGATIONS, module

from nmpcrl.studies import agents, remedies, worlds
from nmpcrl.study import published

# today's module; its investigation; commit, module and name of questions that were registered
REGISTERED = [
    (agents, agents.SAC_AND_TD3, "2feab64", "nmpcrl.claims.agent_questions", "AGENT_QUESTIONS"),
    (remedies, remedies.REMEDIES, "ebf53a4", "nmpcrl.claims.remedy_questions", "REMEDY_QUESTIONS"),
    (worlds, worlds.WORLDS, "cff09a0", "nmpcrl.claims.world_questions", "WORLD_QUESTIONS"),
    (worlds, worlds.WORLDS, "ff05118", "nmpcrl.claims.terminal_questions", "TERMINAL_QUESTIONS"),
]
each = pytest.mark.parametrize(
    ("today", "investigation", "commit", "name", "questions"), REGISTERED
)


@each
def test_questions_and_expectations_are_those_registered(
    today, investigation, commit, name, questions
):
    then = getattr(module(commit, name), questions)
    now = {one.name: one for one in investigation.questions if one.name in then}
    assert [*now] == [*then]
    for one in now.values():
        old = then[one.name]
        assert (one.question, one.expected, one.pilot) == (old.question, old.expected, old.pilot)


@each
def test_thresholds_are_those_registered(today, investigation, commit, name, questions):
    then = module(commit, name)
    plain = {
        one: value
        for one, value in vars(then).items()
        if one.isupper() and isinstance(value, int | float | tuple) and hasattr(today, one)
    }
    for one, value in plain.items():
        now = getattr(today, one)
        assert (now if isinstance(value, int | float) else tuple(now)) == value


def test_settings_and_parts_of_agents_are_those_registered():
    then = module("2feab64", "nmpcrl.claims.agent_questions")
    assert (agents.SETTINGS, agents.SPARING) == (then.SETTINGS, then.SPARING)
    for name, old in then.PARTS.items():
        now = agents.PARTS[name]
        assert (now.places, now.seeds, now.episodes) == (old.places, old.seeds, old.budget)
        assert agents.CHECKPOINTS[name] == old.checkpoints


def test_settings_parts_and_advice_of_remedies_are_those_registered():
    then = module("ebf53a4", "nmpcrl.claims.remedy_questions")
    for name in ("SETTINGS", "ADVICE", "EXPECTED_FIRST"):
        assert [*getattr(remedies, name).items()] == [*getattr(then, name).items()]
    assert [*remedies.PARTS] == ["best", *then.PARTS]
    assert remedies.PARTS["best"].episodes == then.YARDSTICK
    for name, old in then.PARTS.items():
        now = remedies.PARTS[name]
        assert (now.episodes, now.places, now.seeds) == (old.budget, old.layouts, old.seeds)
        for entry in remedies.SETTINGS:
            runs = [(layout, k) for layout in old.layouts_of(entry) for k in range(old.seeds)]
            assert all(now.order(arm) == runs for arm in remedies.arms(entry))


def test_parts_of_worlds_are_those_registered():
    then = module("cff09a0", "nmpcrl.claims.world_questions").PARTS
    then |= {"terminal": module("ff05118", "nmpcrl.claims.terminal_questions").TERMINAL}
    assert [*then] == [*worlds.PARTS]
    for name, old in then.items():
        now = worlds.PARTS[name]
        arms = {"remedy" if arm.startswith("remedy") else arm: arm for arm in now.arms}
        assert (now.episodes, now.places, [*arms]) == (old.budget, old.places, [*old.arms])
        assert all(now.order(arms[one]) == [*old.runs(one)] for one in old.arms)


@each
def test_they_are_older_than_the_rows(today, investigation, commit, name, questions):
    first = published.about(investigation.name)["first"]
    part = "terminal" if questions == "TERMINAL_QUESTIONS" else "all"
    assert git("rev-parse", commit) in git("rev-list", f"{first[part]}^").split()


def test_every_investigation_is_published_with_the_columns_of_its_conditions():
    for investigation in INVESTIGATIONS:
        table = investigation.table()
        assert not table.duplicated(["part", "arm", "place", "k"]).any()
        for (part, arm), rows in table.groupby(["part", "arm"], sort=False):
            order = investigation.parts[part].order(arm)
            assert [*zip(rows.place, rows.k, strict=True)] == order
