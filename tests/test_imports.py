"""What takes long to import is imported where it is used, so that other commands answer at once."""

import subprocess
import sys

import pytest

SLOW = ("torch", "pandas", "matplotlib", "scipy.stats", "numba", "gymnasium")
LIGHT = (
    *("nmpcrl", "nmpcrl.control", "nmpcrl.learning", "nmpcrl.study", "nmpcrl.bench"),
    *("nmpcrl.analysis.metrics", "nmpcrl.analysis.summaries"),
)
LIST = f"\nimport sys\nprint(*[name for name in {SLOW} if name in sys.modules])\n"
TRAIN = """
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import Experiment, run
summarise(run(Experiment("{learner}", episodes=1, steps=3)))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "needed"),
    [
        (f"import {', '.join(LIGHT)}", []),
        ("import nmpcrl.claims.published", ["pandas", "scipy.stats"]),
        (TRAIN.format(learner="ES"), ["numba"]),
        (TRAIN.format(learner="RDES"), ["torch", "numba"]),
    ],
)
def test_nothing_is_imported_before_it_is_needed(script, needed, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    command = [sys.executable, "-c", script + LIST]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.stdout.split() == needed, ended.stderr


def test_learning_has_the_names_that_it_exports_and_no_others():
    exec("from nmpcrl.learning import *", names := {})
    assert set(names) > set(sys.modules["nmpcrl.learning"].__all__)
    with pytest.raises(ImportError, match="cannot import name 'nothing'"):
        exec("from nmpcrl.learning import nothing")
