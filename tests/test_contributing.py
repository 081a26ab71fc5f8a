"""CONTRIBUTING's table at its word: each thing is added in the files of its row, and works."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path

import nbformat
import numpy as np
import pytest

from nmpcrl.commands import main
from nmpcrl.study import paper
from nmpcrl.study.lock import changed, sources

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text()
CELLS = re.findall(r"^\| an? ([\w ]+) \| (.*?) \| ?(.*?) ?\|$", TEXT, flags=re.M)
FILES = {name: re.findall(r"`([^`]+)`", files) for name, files, _ in CELLS}
LOCK = {name: lock for name, _, lock in CELLS}
COPIED = (
    "nmpcrl",
    "book",
    "_toc.yml",
    "pyproject.toml",
    "tests/test_architecture.py",
    "tests/book",
)
IGNORED = shutil.ignore_patterns("__pycache__", "published")

Edit = Callable[[Path], None]  # of the file at this path


def entered(name: str, entry: str) -> Edit:
    """Put an entry first in the dictionary of this name."""

    def edit(path: Path) -> None:
        opened = rf"^{name}\b.*[{{:](?: *#.*)?\n"
        text, count = re.subn(opened, rf"\g<0>{entry}", path.read_text(), count=1, flags=re.M)
        assert count, f"there is no {name} in {path}"
        path.write_text(text)

    return edit


def replaced(before: str, after: str) -> Edit:
    """Replace a text, where it first stands."""

    def edit(path: Path) -> None:
        assert before in path.read_text(), f"{path} does not hold {before!r}"
        path.write_text(path.read_text().replace(before, after, 1))

    return edit


def imported(line: str) -> Edit:
    """Import something from the package, before all else that is."""
    return replaced("\nfrom nmpcrl", f"\n{line}\nfrom nmpcrl")


def added(text: str) -> Edit:
    """Add a text at the end, or make the file."""

    def edit(path: Path) -> None:
        path.write_text(path.read_text() + text if path.exists() else text)

    return edit


def copied(name: str) -> Edit:
    """Make a chapter after the model of another."""

    def edit(path: Path) -> None:
        model = path.with_name(f"{name}.ipynb").read_text()
        path.write_text(model.replace(name, path.stem))

    return edit


def shown(source: str) -> Edit:
    """Add a cell with a figure to a chapter."""

    def edit(path: Path) -> None:
        notebook = nbformat.read(path, as_version=4)
        mystnb = {"image": {"alt": "A few dots.", "width": "100%"}}
        metadata = {"tags": ["hide-input"], "mystnb": mystnb}
        notebook.cells.append(nbformat.v4.new_code_cell(source, metadata=metadata))
        caption = '<a id="fig-new"></a>\n**Fig. 2.7.** The end of theta.'
        tags = {"tags": ["caption"]}
        notebook.cells.append(nbformat.v4.new_markdown_cell(caption, metadata=tags))
        nbformat.write(notebook, path)

    return edit


def both(*edits: Edit) -> Edit:
    """Some edits of one file."""

    def edit(path: Path) -> None:
        for one in edits:
            one(path)

    return edit


ADDED_LEARNERS = """\
    "half": Entry(lambda e, nmpc, _: half_expected_sarsa(nmpc, e.alpha)),
    "slow": Entry(
        lambda e, nmpc, _: slow_gradient_expected_sarsa(nmpc, e.alpha, e.beta), (*VALUING, "beta")
    ),
    "shy": _imitating(shy_deep_expected_sarsa, with_theta=False),
"""

EDITS: dict[str, dict[str, Edit]] = {  # what is added in which file, by row
    "learner": {
        "nmpcrl/learning/learners.py": added('''

def half_expected_sarsa(nmpc: Controller, alpha: float) -> Learner:
    """ES with steps half as long."""
    return Learner("half", SecondSolve(nmpc), semi_gradient(alpha / 2), nmpc.gamma)


def slow_gradient_expected_sarsa(nmpc: Controller, alpha: float, beta: float) -> Learner:
    """GES with w moving a tenth as fast."""
    rule = gradient_td(alpha, beta / 10, nmpc.gamma)
    return Learner("slow", SecondSolve(nmpc), rule, nmpc.gamma)


def shy_deep_expected_sarsa(
    nmpc: Controller, network: "QNetwork", alpha: float, **options: Any
) -> Learner:
    """DES with steps a third as long."""
    bootstrap = Imitation(network, with_theta=False, **options)
    return Learner("shy", bootstrap, semi_gradient(alpha / 3), nmpc.gamma)
'''),
        "nmpcrl/study/learners.py": both(
            imported(
                "from nmpcrl.learning.learners import (\n    half_expected_sarsa,\n"
                "    shy_deep_expected_sarsa,\n    slow_gradient_expected_sarsa,\n)"
            ),
            entered("LEARNERS", ADDED_LEARNERS),
        ),
        "nmpcrl/report/figures/style.py": entered(
            "LOOKS",
            "".join(
                f'    "{name}": Look("#332288", "-", "*"),\n' for name in ("half", "slow", "shy")
            ),
        ),
    },
    "plant": {},
    "layout": {
        "nmpcrl/study/paper.py": replaced(
            '\n    "F": (',
            '\n    "G": ((0.2, 1.9), (2.1, 4.4), (3.6, 2.3), (4.9, -0.4)),\n    "F": (',
        ),
    },
    "solver": {
        "nmpcrl/control/solvers/relay.py": added('''"""A solver that leaves the work to another."""

from dataclasses import dataclass
from typing import ClassVar

from nmpcrl.control.ocp import Ocp
from nmpcrl.control.solvers.nlpsol import Ipopt
from nmpcrl.control.solvers.solver import Prepared, Solver


@dataclass(frozen=True)
class Relay(Solver):
    """Ipopt by another name."""

    name: ClassVar[str] = "relay"

    def prepare(self, ocp: Ocp) -> Prepared:
        """See `Solver.prepare`."""
        return Ipopt(self.tolerance).prepare(ocp)
'''),
        "nmpcrl/control/solvers/__init__.py": both(
            imported("from nmpcrl.control.solvers.relay import Relay"),
            replaced("(Riccati, Fatrop, Ipopt)", "(Riccati, Fatrop, Ipopt, Relay)"),
        ),
    },
    "metric": {
        "nmpcrl/analysis/metrics.py": added('''

def largest_reduction(cost: Vector) -> float:
    """By how much the least of some noise-free costs is below the first."""
    return float(cost[0] - cost.min())
'''),
        "nmpcrl/analysis/rows.py": replaced(
            '    "best_cost"',
            '    "largest_reduction": lambda run: metrics.largest_reduction('
            'run.evaluations["cost"]),\n    "best_cost"',
        ),
    },
    "variant": {
        "nmpcrl/study/design.py": replaced(
            "    found |= {\n",
            '    found |= {\n        "N = 8": Variant("", "horizon N = 8", {"horizon": 8}),\n',
        ),
    },
    "claim": {
        "nmpcrl/claims/own_claims.py": replaced(
            "    for claim in (\n",
            """    for claim in (
        AtMost(
            name="B9",
            statement="GES is at least as good as ES.",
            question="Does GES end at no higher cost than ES?",
            border="not higher",
            would_change="Nothing that we know of.",
            threshold=0.0,
            **compared(("GES", "ES")),
        ),
""",
        ),
    },
    "figure": {
        "nmpcrl/report/figures/runs/ends.py": added('''"""Where theta ends."""

from matplotlib.figure import Figure

from nmpcrl.analysis.metrics import final_theta
from nmpcrl.report.figures.style import dots, headed, page, subplots
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs


@page
def ends(runs: Runs[Records]) -> Figure:
    """The last theta of each run, a marker a learner."""
    figure, axes = subplots()
    for experiment, records in runs.items():
        axes.plot(final_theta(records), **dots(experiment.learner))
    axes.set_xlabel("component")
    return headed(figure, f"theta ends in {len(runs)} places")
'''),
        "book/02_expected_sarsa.ipynb": shown(
            "from nmpcrl.report.figures.runs.ends import ends\n\nends(runs)"
        ),
    },
    "chapter": {
        "book/08_again.ipynb": copied("01_mdp_and_nmpc"),
        "_toc.yml": replaced("book/07_beyond\n", "book/07_beyond\n      - file: book/08_again\n"),
        "book/reproduce.md": replaced(
            "| `solver` |", "| `08_again` | `layout`, `horizon` |\n| `solver` |"
        ),
        "nmpcrl/course/checks/again.py": added(
            "from nmpcrl.course.checks.mdp_and_nmpc import *  # noqa: F403\n"
        ),
    },
    "live figure": {
        "nmpcrl/report/live/worth.py": added('''"""A live figure of what the start is worth."""

from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.report.live import frame
from nmpcrl.report.live.problem import problem_of


def worth(nmpc: Nmpc, theta: Vector) -> HTML:
    """V at the start."""
    asked = {"state": nmpc.task.start.tolist(), "theta": theta.tolist()}
    data = {"asked": asked, "problem": problem_of(nmpc)}
    return frame.solving("worth", nmpc, lambda: data, frame.scripts_of("worth"))
'''),
        "nmpcrl/report/live/__init__.py": both(
            imported("from nmpcrl.report.live.worth import worth"),
            replaced("__all__ = [", '__all__ = [\n    "worth",\n    '),
        ),
        "book/_static/live/worth.js": added("""// The live figure of what the start is worth.
(() => {
  "use strict";

  const { parts: shared, words: { worth: words } } = window.nmpcrl;

  shared.begin("worth", (figure, { asked, problem: { discs } }, nmpc) => {
    shared.heading(figure, words);
    const plan = nmpc.solve({ ...asked, discs, horizon: 10 });
    shared.results(figure)(words.results(plan));
  });
})();
"""),
        "book/_static/live/worth_words.js": added("""// Every word that a reader of the worth sees.
(() => {
  "use strict";

  const { words } = window.nmpcrl;

  words.worth = {
    map: "V at the start", title: "Try it.", hint: "Look.",
    results: ({ value }) => [["V =", words.parts.fixed(value, 6)]],
  };
})();
"""),
        "book/03_rdes.ipynb": shown("from nmpcrl.report import live\n\nlive.worth(nmpc, theta)"),
        "tests/book/live_page.py": entered("CHAPTERS", '    "worth": "03_rdes",\n'),
    },
}

PROBES = {  # what is to work then, by row; run in the copy, in one process
    "learner": """
from nmpcrl.report.figures import style
from nmpcrl.study import Experiment, run

short = {"episodes": 2, "steps": 5, "evaluate_every": 1}
half, es = run(Experiment("half", **short)), run(Experiment(alpha=Experiment().alpha / 2, **short))
assert half.facts["stopped"] == "finished"
assert (half.steps["theta"][-1] != half.experiment["theta"]).any()
assert (half.steps["theta"] == es.steps["theta"]).all()
style.line("half")

from nmpcrl.study.provenance import key, versions

def theta(learner, **fields):
    return run(Experiment(learner, **short | fields)).steps["theta"]

default, fast = Experiment("slow", **short), Experiment("slow", beta=1e-7, **short)
assert key(default) != key(fast) and fast.canonical.beta == 1e-7
assert (theta("slow", beta=1e-7) == theta("GES")).all()  # a tenth of 1e-7 is GES's
assert (theta("slow") != theta("GES")).any()

fit = {"episodes": 2, "steps": 80}
other = {"zeta": 1e-3, "gated": False, "network": "tanh"}
runs = {name: theta("shy", **fit | {name: value}) for name, value in other.items()}
keys = {key(Experiment("shy", **short | {name: value})) for name, value in other.items()}
assert len({key(Experiment("shy", **short)), *keys}) == 4
assert all((one[-1] != theta("shy", **fit)[-1]).any() for one in runs.values())
assert "torch" in versions(Experiment("shy")) and "torch" not in versions(Experiment("slow"))
third, des = Experiment("shy", **fit), Experiment("DES", alpha=Experiment().alpha / 3, **fit)
third, des = run(third), run(des)
assert (third.steps["theta"] == des.steps["theta"]).all()
""",
    "layout": """
from nmpcrl.study import Experiment, design, layouts, paper, run

assert layouts.screen(paper.LAYOUTS["G"]).passed
assert run(Experiment(layout="G", episodes=1, steps=5)).facts["stopped"] == "finished"
assert {one.layout for one in design.whole_study()} == set("ABCDEF")
""",
    "solver": """
import numpy as np

from nmpcrl.bench.learners import time_learners
from nmpcrl.claims import published
from nmpcrl.control.solvers.relay import Relay
from nmpcrl.report.figures.verdicts import claims
from nmpcrl.study import Experiment, paper, run

theta = np.array(paper.THETA_INIT)
values = [paper.nmpc(solver=one).solve(paper.START, theta).value for one in (Relay(), "riccati")]
np.testing.assert_allclose(*values, rtol=1e-6)
assert run(Experiment(solver="relay", episodes=1, steps=5)).facts["stopped"] == "finished"
timings = time_learners(("ES", "RDES"), ("ipopt", "relay"), steps=2)
(verdict,) = [one for one in published.load().verdicts if one.claim == "C3"]
axis = claims.times(timings, verdict, "RDES").axes[0]
assert "relay" in [label.get_text() for label in axis.get_yticklabels()]
""",
    "metric": """
from nmpcrl.analysis.rows import table
from nmpcrl.analysis.summary import summarise
from nmpcrl.study import Experiment, run

experiment = Experiment(episodes=2, steps=5, evaluate_every=1)
records = run(experiment)
cost = records.evaluations["cost"]
assert table({experiment: summarise(records)}).largest_reduction.tolist() == [cost[0] - cost.min()]
""",
    "variant": """
from click.testing import CliRunner

from nmpcrl.commands import main
from nmpcrl.study import paper
from nmpcrl.study import design

found = CliRunner().invoke(main, ["study", "--part", "N = 8", "--dry-run"])
assert found.output.startswith(f"0 of {len(design.variant('N = 8'))} runs are stored"), found.output
""",
    "claim": """
import pandas as pd

from nmpcrl.claims import own_claims, published
from nmpcrl.claims.rule import judge
from nmpcrl.report.tables import claim_table

runs = pd.DataFrame(published.load().rows.values())
runs = runs[runs.variant == "main"]
(verdict,) = [one for one in judge(own_claims.OWN_CLAIMS, runs) if one.claim == "B9"]
assert verdict.counts["all"][1] == 120
assert "GES is at least as good as ES." in claim_table(own_claims.OWN_CLAIMS.values(), "")
""",
    "figure": """
import nbformat

from nmpcrl.study import Experiment, Runs, run

one = Experiment(episodes=1, steps=5)
cell = nbformat.read("book/02_expected_sarsa.ipynb", as_version=4).cells[-2]
names = {"runs": Runs({one: run(one)})}
exec(cell.source.replace("\\nends(", "\\nfigure = ends("), names)
names["figure"].savefig("ends.svg")
assert "theta ends in 1 places" in names["figure"].get_suptitle()
""",
    "chapter": """
from driver import project
from driver.build import chapters

assert project.ROOT.samefile(".")
assert "08_again" in project.notebooks()
assert isinstance(chapters.ask(chapters.known("08_again"), {"layout": "D"}), chapters.Needs)
""",
    "live figure": """
from pathlib import Path

import numpy as np

from nmpcrl.report import live
from nmpcrl.study import paper

nmpc, theta = paper.nmpc("A"), np.array(paper.THETA_INIT)
names = {"nmpc": nmpc, "theta": theta}
exec("from nmpcrl.report import live\\n\\nfigure = live.worth(nmpc, theta)", names)
Path("worth.html").write_text('<meta charset="utf-8">' + names["figure"].data, "utf-8")
""",
}
OWN_TESTS = (  # of the project, in the copy
    "tests/test_architecture.py",
    *("tests/book/test_notebooks.py", "tests/book/test_notation.py"),
    *("-k", "architecture or 08_again or contents or parameters or (figures and 02_expected)"),
)
SCRIPT = """
import json, sys, traceback

failures = {}
for name, probe in json.load(sys.stdin).items():
    try:
        exec(probe, {})
    except Exception:
        failures[name] = traceback.format_exc()
print(json.dumps(failures))
"""

each_row = pytest.mark.parametrize("name", EDITS)


def copy(target: Path) -> Path:
    """The project in another folder."""
    for name in COPIED:
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, target / name, ignore=IGNORED)
        else:
            shutil.copy2(ROOT / name, target / name)
    return target


def called(scratch: Path, *arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    """Python in the copy, with the published study of the project."""
    places = {"PYTHONPATH": f"{scratch}{os.pathsep}{scratch / 'book'}", "NMPCRL_RUNS": "runs"}
    places["NMPCRL_PUBLISHED"] = str(ROOT / "book/published")
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=scratch,
        env=os.environ | places,
        input=given,
        capture_output=True,
        text=True,
    )


@pytest.fixture(scope="module")
def scratch(tmp_path_factory) -> Path:
    """A copy of the project with one more of everything."""
    target = copy(tmp_path_factory.mktemp("scratch"))
    for edits in EDITS.values():
        for file, edit in edits.items():
            edit(target / file)
    return target


@pytest.fixture(scope="module")
def failures(scratch) -> dict[str, str]:
    """What did not work of what was added, by row."""
    done = called(scratch, "-c", SCRIPT, given=json.dumps(PROBES))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_files_rooms_commands_and_targets_that_are_named_are_there():
    for name in re.findall(r"`([\w.]+/[\w./]+\.\w+)`", TEXT):
        assert re.search(r"/[A-Z_]{4,}[a-z]*\.", name) or (ROOT / name).is_file(), name
    rooms = {path.parent.name for path in ROOT.glob("nmpcrl/*/__init__.py")}
    assert set(re.findall(r"^\| `(\w+)` \|", TEXT, flags=re.M)) == rooms
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), flags=re.M))
    assert set(re.findall(r"\bmake ([a-z-]+)(?=[ `]|$)", TEXT, flags=re.M)) <= targets
    for command in re.findall(r"`nmpcrl ([^`]+)`", TEXT):
        name, *arguments = shlex.split(command)
        main.commands[name].make_context(name, arguments)


def test_the_table_has_these_rows():
    assert set(FILES) == set(LOCK) == set(EDITS) == {*PROBES, "plant"}


@each_row
def test_a_thing_is_added_in_the_files_of_its_row_and_in_no_other(name):
    patterns = [re.sub(r"[A-Z][A-Z_]+", "*", file) for file in FILES[name]]
    assert len(patterns) == len(EDITS[name])
    for file in EDITS[name]:
        assert any(fnmatch(file, pattern) for pattern in patterns), file


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("name", PROBES)
def test_what_was_added_works(failures, name):
    assert name not in failures, failures[name]


@pytest.mark.weekly
@pytest.mark.slow
def test_the_live_figure_that_was_added_solves_in_a_browser(scratch, failures, browser):
    assert "live figure" not in failures
    page = browser.new_page()
    page.goto((scratch / "worth.html").as_uri())
    said = page.locator("figure.live .results p").inner_text()
    value = paper.nmpc("A").solve(paper.START, np.array(paper.THETA_INIT)).value
    assert said == f"V = {value:.6f}"
    page.close()


@pytest.mark.weekly
@pytest.mark.slow
def test_the_projects_own_tests_take_what_was_added(scratch):
    done = called(scratch, "-m", "pytest", "-q", "-p", "no:cacheprovider", *OWN_TESTS)
    assert done.returncode == 0, done.stdout


@pytest.mark.weekly
@pytest.mark.slow
def test_the_lock_is_made_anew_where_the_row_says_so(scratch):
    """No file of the package is in two rows, so one copy tells them apart."""
    moved = {f"nmpcrl/{file}" for file in changed(sources(scratch / "nmpcrl"), sources())}
    assert {name for name, edits in EDITS.items() if moved & edits.keys()} == {
        name for name, lock in LOCK.items() if lock == "anew"
    }
    assert moved <= {file for edits in EDITS.values() for file in edits}
