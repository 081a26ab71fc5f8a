"""The hash of a file's code, the files in the lock, and the runs of earlier locks."""

import subprocess
import sys

import pytest

from nmpcrl.study import lock, provenance
from nmpcrl.study.lock import changed, code, sources

MODULE = '''"""A module."""

from collections.abc import Callable

import numpy as np

from nmpcrl.study.paper import ALPHA as RATE
from nmpcrl.study.records import final_cost

__all__ = ["Rule", "step"]


class Rule:
    """A rule."""

    rate: float = RATE  # of learning


def step(theta: float, by: Callable[[float], float]) -> float:
    """A step."""
    return np.abs(theta) - Rule.rate * by(final_cost(theta))
'''
NUMBERS = [
    ("= RATE", "= 2 * RATE"),
    ("np.abs(theta)", "theta"),
    ("Rule.rate * by", "by"),
    ("import ALPHA", "import BETA"),
    ("import final_cost", "import initial_cost as final_cost"),
    ("import numpy as np", "import jax.numpy as np"),
    ("nmpcrl.study.records", "nmpcrl.analysis.metrics"),
    ("rate: float", "rate: int"),
]
NO_NUMBERS = [
    ("A module", "Some module"),
    ("A step.", "One step.\n\n    With a second paragraph.\n    "),
    ("  # of learning", ""),
    ("\n\n\ndef", "\n\n\n# A comment.\n\n\ndef"),
    ("by: Callable[[float], float]", "by: Callable[..., float]"),
    (") -> float:", ") -> object:"),
    ("import Callable", "import Callable, Mapping"),
    ("import numpy as np", "import math\n\nimport numpy as np"),
    ('["Rule", "step"]', '["step"]'),
    ("nmpcrl.study.records", "nmpcrl.study.below.records"),
]


@pytest.mark.parametrize(("before", "after"), [*NUMBERS, *NO_NUMBERS])
def test_an_edit_is_noticed_where_it_can_change_a_number(before, after):
    assert before in MODULE
    edited = MODULE.replace(before, after, 1)
    assert (code(edited) != code(MODULE)) == ((before, after) in NUMBERS)


def test_a_name_passed_on_as_another_and_an_edited_file_count_and_a_moved_one_does_not():
    assert code('"""A package."""\n\nfrom nmpcrl.study.run import run\n\n__all__ = ["run"]\n') == ""
    assert code("from nmpcrl.study.run import run as train\n")
    before = {"a.py": "1", "b.py": "2", "c.py": "2"}
    assert changed({"a.py": "1", "b.py": "2", "d/c.py": "2"}, before) == []
    assert changed({"a.py": "3", "b.py": "2", "c.py": "2"}, before) == ["a.py"]
    assert changed({"d/a.py": "3", "b.py": "2", "c.py": "2"}, before) == ["a.py", "d/a.py"]
    assert changed({"a.py": "1", "b.py": "2"}, before) == ["b.py", "c.py"]


WITHOUT_NUMBERS = {  # files that a run imports and that store, lock, describe or start processes
    *("study/jobs.py", "study/lock.py", "study/provenance.py", "study/store.py", "study/design.py"),
    *("study/files.py", "study/limits.py", "study/machine.py", "study/refusal.py"),
}
IMPORTS = """
import sys
from pathlib import Path
import nmpcrl
from nmpcrl.analysis.search import search
from nmpcrl.analysis.rows import row
from nmpcrl.analysis.summary import summarise
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.run import run

for learner in ("ES", "RDES", "GES"):
    row(summarise(run(Experiment(learner, episodes=1, steps=5, evaluate_every=1))))
search("A", 40)
for module in list(sys.modules.values()):
    if module.__name__.startswith("nmpcrl."):
        print(Path(module.__file__).relative_to(Path(nmpcrl.__file__).parent).as_posix())
"""


def test_the_lock_has_every_file_that_a_run_a_summary_and_a_search_import_as_it_is():
    """If a new file bears on no number: add it to `WITHOUT_NUMBERS`, else to `FILES`."""
    made = subprocess.run(
        [sys.executable, "-c", IMPORTS], capture_output=True, text=True, check=True
    )
    imported = {name for name in made.stdout.split() if code((lock.ROOT / name).read_text())}
    listed = set(sources())
    assert imported - listed - WITHOUT_NUMBERS == set()
    assert {one for one in listed - imported if one.startswith(("study", "analysis"))} == set()
    assert all(any(lock.ROOT.glob(one)) for one in lock.FILES)
    assert all((lock.ROOT / one).exists() for one in lock.OTHER_HOSTS)
    assert changed(sources(), lock.locked()["sources"]) == []
    assert lock.locked()["epochs"] == provenance.EPOCHS


def test_a_warning_names_the_changed_files_once(monkeypatch, capsys):
    then = {**sources(), "learning/updates.py": "another"}
    monkeypatch.setattr(lock, "locked", lambda: {"sources": then})
    monkeypatch.setenv(lock.WARNED, "")
    for _ in range(2):
        lock.warn_of_changes.__wrapped__()
    said = capsys.readouterr().err
    assert said.startswith("learning/updates.py: changed since the stored runs were trained")
    assert said.count("\n") == 1
