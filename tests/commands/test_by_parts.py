"""The commands whose runs come in parts: what is missing, and what they refuse."""

import pytest

pytestmark = pytest.mark.usefixtures("trains_here")


@pytest.mark.parametrize(
    ("words", "first", "other"),
    [
        (("remedies", "--entry", "ES"), "tune: 0 of 60 runs", "judge 50: 0 of 240 runs"),
    ],
)
def test_a_dry_run_counts_the_runs_and_says_what_they_take(command, words, first, other):
    said = command(*words, "--dry-run")
    assert said.exit_code == 0, said.output
    assert f"{first} are stored; the others take about" in said.stdout
    assert other in said.stdout
    assert "all that is missing: about" in said.stdout


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("remedies", "--part", "all"), "no part 'all'; there are best, tune, judge 50"),
        (("remedies", "--entry", "SAC"), "no entry 'SAC'"),
    ],
)
def test_what_there_is_not_is_refused_with_what_there_is(command, words, said):
    assert_refused(command(*words), f"there is {said}")


@pytest.mark.parametrize(
    ("words", "entry"),
    [
        (("remedies", "--part", "judge 50", "--entry", "ES"), "ES"),
    ],
)
def test_nothing_is_judged_before_it_is_tuned(command, words, entry):
    assert_refused(command(*words), f"{entry} is not tuned yet")


@pytest.mark.parametrize("name", ["remedies"])
def test_what_is_not_published_is_not_judged(command, name):
    assert_refused(command(name, "--judge"), f"nmpcrl {name} --publish")


def assert_refused(ended, said):
    assert ended.exit_code == 1
    assert said in ended.stderr
