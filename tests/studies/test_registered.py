"""Parts, thresholds and questions are those that were committed before the first row was made."""

import ast
from dataclasses import asdict
from operator import attrgetter
from pathlib import Path

import pandas as pd
import pytest
from history import INVESTIGATIONS, git, module

from nmpcrl.studies import agents, difficulty, interventions, population, remedies, worlds
from nmpcrl.studies.population import POPULATION
from nmpcrl.study import published

NAMES = ("today", "investigations", "commit", "name", "questions", "parts")
DRAWN = (POPULATION, interventions.INTERVENTIONS)
WORLDS = ((worlds,), (worlds.WORLDS,))
REGISTERED = [  # today's modules; commit, module and name of questions; their parts in `first`
    ((agents,), (agents.SAC_AND_TD3,), "2feab64", "agent_questions", "AGENT_QUESTIONS", ("all",)),
    ((remedies,), (remedies.REMEDIES,), "ebf53a4", "remedy_questions", "REMEDY_QUESTIONS",
     ("all",)),
    (*WORLDS, "cff09a0", "world_questions", "WORLD_QUESTIONS", ("all",)),
    (*WORLDS, "ff05118", "terminal_questions", "TERMINAL_QUESTIONS", ("terminal",)),
    ((population, difficulty), DRAWN, "46c248b", "population_questions", "QUESTIONS",
     tuple(population.PARTS)),
]  # fmt: skip
each = pytest.mark.parametrize(NAMES, REGISTERED)


@each
def test_questions_and_thresholds_are_those_registered_before_the_first_row(
    today, investigations, commit, name, questions, parts
):
    registered = module(commit, f"nmpcrl.claims.{name}")
    then = getattr(registered, questions)
    every = (one for each in investigations for one in each.questions)
    now = {one.name: one for one in every if one.name in then}
    assert {*now} == {*then}
    for one in now.values():
        old = then[one.name]
        assert (one.question, one.expected, one.pilot) == (old.question, old.expected, old.pilot)
    names = {one: value for each in today for one, value in vars(each).items()}
    for one, value in vars(registered).items():
        if one.isupper() and isinstance(value, int | float | tuple) and one in names:
            kept = names[one] if isinstance(names[one], int | float) else tuple(names[one])
            assert kept == value, one
    first = published.about(investigations[0].name)["first"]
    for part in parts:
        assert git("rev-parse", commit) in git("rev-list", f"{first[part]}^").split()


def test_the_expected_shares_and_runs_in_drawn_layouts_are_those_registered():
    questions = module("46c248b", "nmpcrl.claims.population_questions")
    assert {name: asdict(one) for name, one in population.EXPECTED.items()} == {
        name: asdict(one) for name, one in questions.EXPECTED.items()
    }
    then = module("46c248b", "nmpcrl.study.population_design").arms()
    plan = pd.DataFrame(one for part in population.PARTS for one in POPULATION.conditions(part))
    for part in (part for part in then if "judge" not in part):
        rows = plan[plan.part == part]
        assert {*map(_varied, population.experiments(rows))} == {*map(_varied, then[part])}
    every = [one for runs in then.values() for one in runs]  # judged in three steps, not in two
    assert {*map(_varied, population.experiments(plan))} == {*map(_varied, every)}


_varied = attrgetter("learner", "layout", "decay", "seed", "horizon", "alpha", "episodes")


@pytest.mark.parametrize(
    ("commit", "names", "parts"),
    [
        ("a02ad04", ("DRAW, SAMPLE", "NUDGE"), ("six", "drawn")),
        ("f8a3b4d", ("DRAW, SAMPLE", "NUDGE", "_stopped", "_shuffled"), ("others",)),
    ],
)
def test_the_runs_that_are_made_again_are_those_registered(commit, names, parts):
    then = ast.parse(git("show", f"{commit}:nmpcrl/claims/interventions.py"))
    now = ast.parse(Path(interventions.__file__).read_text("utf-8"))
    assert [_defined(then, name) for name in names] == [_defined(now, name) for name in names]
    assert tuple(interventions.ARMS) == ast.literal_eval(_defined(then, "ARMS"))
    first = published.about("interventions")["first"]
    for part in parts:
        assert git("rev-parse", commit) in git("rev-list", f"{first[part]}^").split()


def _defined(tree, name):
    """The code of a function, or the value of a constant."""
    for node in tree.body:
        if getattr(node, "name", "") == name:
            return ast.unparse(node)
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]).strip("()") == name:
            return ast.unparse(node.value)
    raise AssertionError(name)


def test_settings_and_parts_of_agents_remedies_and_worlds_are_those_registered():
    then = module("2feab64", "nmpcrl.claims.agent_questions")
    assert (agents.SETTINGS, agents.SPARING) == (then.SETTINGS, then.SPARING)
    for name, old in then.PARTS.items():
        now = agents.PARTS[name]
        assert (now.places, now.seeds, now.episodes) == (old.places, old.seeds, old.budget)
        assert agents.CHECKPOINTS[name] == old.checkpoints
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
    then = module("cff09a0", "nmpcrl.claims.world_questions").PARTS
    then |= {"terminal": module("ff05118", "nmpcrl.claims.terminal_questions").TERMINAL}
    assert [*then] == [*worlds.PARTS]
    for name, old in then.items():
        now = worlds.PARTS[name]
        arms = {"remedy" if arm.startswith("remedy") else arm: arm for arm in now.arms}
        assert (now.episodes, now.places, [*arms]) == (old.budget, old.places, [*old.arms])
        assert all(now.order(arms[one]) == [*old.runs(one)] for one in old.arms)


def test_every_investigation_is_published_with_the_columns_of_its_conditions():
    for investigation in INVESTIGATIONS:
        table = investigation.table()
        assert not table.duplicated(["part", "arm", "place", "k"]).any()
        for (part, arm), rows in table.groupby(["part", "arm"], sort=False):
            if investigation.parts[part].at and not investigation.is_current(part):
                continue  # of runs that were stopped in an earlier edition
            order = investigation.parts[part].order(arm)
            assert [*zip(rows.place, rows.k, strict=True)] == order
