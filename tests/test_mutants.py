"""Every mutant can be made, and, once a week, is caught."""

import subprocess
import sys

import mutants
import pytest


def test_the_line_of_every_mutant_is_in_the_library_once_and_its_tests_are_there():
    times = {
        (one.file, one.old): (mutants.ROOT / "nmpcrl" / one.file).read_text("utf-8").count(one.old)
        for one in mutants.mutants()
    }
    assert {one: count for one, count in times.items() if count != 1} == {}
    files = {name for one in mutants.mutants() for name in one.tests.split()}
    assert [name for name in files if not (mutants.ROOT / "tests" / name).exists()] == []


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize(
    "package", sorted({one.file.partition("/")[0] for one in mutants.mutants()})
)
def test_every_mutant_is_caught(package):
    run = [sys.executable, mutants.__file__, package]
    done = subprocess.run(run, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
