"""What a live figure displays: the library's own problem, whole scripts, and words if it cannot."""

import gzip
import json
import re
from base64 import b64decode

import numpy as np
import pytest
from builders import raising

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims import published
from nmpcrl.control import Nmpc
from nmpcrl.control import browser as alone
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.learning.rollout import evaluate
from nmpcrl.report import live
from nmpcrl.report.live import frame, published_runs
from nmpcrl.report.live.learning import MOST, NARROW, WIDE, setting
from nmpcrl.report.live.problem import problem_of
from nmpcrl.study import Experiment, ParameterError, design, layouts, paper
from nmpcrl.study.geometry import MOST_OBSTACLES

THETA = np.array(paper.THETA_INIT)
NMPC = paper.nmpc("C", horizon=7)
FIGURES = {
    "chain": lambda: live.chain(0.1, 0.4, 0.97),
    "controller": lambda: live.controller(NMPC, THETA, 130),
    "gradient": lambda: live.gradient(NMPC, NMPC.task.start, THETA, np.array([1e-6, 1e-4, 1e-2])),
    "intro": live.intro,
    "laboratory": live.laboratory,
    "moving": live.moving,
    "runs": lambda: live.runs("DES", "RDES"),
}
each_figure = pytest.mark.parametrize("figure", FIGURES)


@pytest.fixture(autouse=True)
def small(monkeypatch) -> None:
    """A module of three bytes."""
    monkeypatch.setattr(browser, "module", lambda *of: b"abc")


def given(figure: str) -> dict:
    """What the script is given."""
    return json.loads(re.search(r'application/json">(.*)</script>', FIGURES[figure]().data)[1])


@each_figure
def test_the_output_is_whole_and_hidden_until_its_scripts_run(figure):
    html = FIGURES[figure]().data
    files = re.findall(r'data-file="([^"]+)"', html)
    assert files[:2] == [frame.STYLE, frame.MODULE]
    assert files[-1] == f"{figure}.js"
    assert not re.search(r"\b(src|href)=|https?://(?!www\.w3\.org/2000/svg)", html)
    assert gzip.decompress(b64decode(re.search(r'nmpcrl, module: "([^"]+)"', html)[1])) == b"abc"
    assert re.match(rf'<figure class="live" data-figure="{figure}" hidden>\n<p>.* trusted', html)


@each_figure
def test_without_a_compiler_or_scripts_there_is_a_sentence(figure, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setenv("NMPCRL_LIVE", str(tmp_path / "nowhere"))
        assert "NMPCRL_LIVE" in FIGURES[figure]().data
    monkeypatch.setattr(browser, "module", raising(CannotCompile("OP_ERFINV is not known")))
    said = "<p>There is no live figure here: OP_ERFINV is not known.</p>"
    assert FIGURES[figure]().data == said


def test_the_problem_is_the_controller_s_and_each_slider_has_a_step_at_its_first_value():
    """But for the longest horizon and an obstacle, of which a page makes what is asked."""
    shown, own = given("controller")["problem"], alone.problem(NMPC.problem)
    for name in ("lower", "upper", "sides", "tie", "states", "inputs", "theta", "tolerance"):
        assert shown[name] == own[name]
    assert shown["discount"][:8] == own["discount"]
    assert [one[:7] for one in shown["drawn"]] == own["drawn"]
    assert shown["weights"] * 4 == own["weights"]
    assert shown["discs"] == np.transpose(NMPC.task.discs).tolist()
    assert shown["most_discs"] == MOST_OBSTACLES
    for active in (False, True):
        here = Nmpc(NMPC.plant, NMPC.task, horizon=7, ties_active=active)
        assert problem_of(here)["tie"] == here.ocp.tie
    data, chain = given("controller"), given("chain")
    first = dict(zip(data["names"], data["theta"], strict=True)) | {"horizon": data["horizon"]}
    for values, of in ((first, data["ranges"]), (chain["given"], chain["ranges"])):
        for name, (least, most, step) in of.items():
            assert least <= values[name] <= most
            steps = (values[name] - least) / step
            assert steps == pytest.approx(round(steps), abs=1e-9)


@pytest.mark.parametrize("figure", ["controller", "intro", "moving", "runs"])
def test_a_map_shows_every_circle(figure):
    data = given(figure)
    x, y, width, height = data["view"]
    wide = data.get("layouts", {"here": data["problem"]["discs"]})
    for cx, cy, clearance in np.concatenate([*wide.values()]):
        reach = clearance / 2 - 1e-9
        assert x <= cx - reach < cx + reach <= x + width
        assert y <= cy - reach < cy + reach <= y + height


def test_the_introduction_trains_as_the_study_where_a_gap_is_open_and_where_one_closes():
    data, experiment = given("intro"), Experiment("ES")
    for name in ("learner", "alpha", "decay", "seed", "episodes", "steps", "horizon"):
        assert data["settings"][name] == getattr(experiment, name)
    assert data["settings"]["decayRate"] == experiment.decay_rate
    assert layouts.screen(paper.LAYOUTS[WIDE]).kind == "open"
    assert layouts.screen(paper.LAYOUTS[NARROW]).kind == "closing"


def test_the_laboratory_allows_what_an_experiment_takes_and_its_text_closes_a_gap():
    for field in given("laboratory")["fields"]:
        name = field["name"]
        assert field["default"] == getattr(Experiment(), name)
        if "choices" in field:
            assert all(Experiment(**{name: one}) for one in field["choices"])
            continue
        kind = int if field["whole"] else float
        assert Experiment(**{name: kind(field["least"])})
        assert Experiment(**{name: kind(field["most"])})
        beyond = [field["least"] - 1, *([] if name in MOST else [field["most"] * 2])]
        for one in beyond:
            with pytest.raises(ParameterError):
                Experiment(**{name: kind(one)})
    assert setting("zeta")["read_by"] == ["DES", "RDES"]
    page = (frame.ROOT / "book/laboratory.ipynb").read_text()
    values = [float(one) for one in re.findall(r"theta=[\d.,]*,([\d.]+)", page)]
    (centres,) = set(re.findall(r"#layout=([-\d.,;]+)", page))
    assert [[float(x) for x in one.split(",")] for one in centres.split(";")] == [
        [*one] for one in paper.LAYOUTS["F"]
    ]
    task = paper.task("F")
    first = evaluate(paper.nmpc("F"), THETA, paper.STEPS)
    closed, low = values
    assert low < closes_at(task, first.states[:, :2]) < closed


def unpacked(packed: dict) -> dict:
    """The runs of a page, by (learner, decay, seed): costs of training, costs, and theta."""
    planes = np.frombuffer(gzip.decompress(b64decode(packed["numbers"])), np.uint8)
    steps = np.ascontiguousarray(planes.reshape(4, -1).T).view("<u4").ravel()
    rows = np.cumsum(steps, dtype=np.uint32).view("<f4").reshape(len(packed["runs"]), -1)
    found = {}
    for name, row in zip(packed["runs"], rows, strict=True):
        learner, decay, seed = name.split()
        training, costs, theta = np.split(row, [300, 331])
        found[learner, decay, int(seed)] = training, costs, theta.reshape(9, 301).T
    return found


def assert_published(runs: dict, layout: str) -> None:
    known = published.load()
    for (learner, decay, seed), (training, costs, theta) in runs.items():
        one = known.summaries[Experiment(learner, layout=layout, decay=decay, seed=seed)]
        count = len(one.evaluations["cost"])
        np.testing.assert_array_equal(training, one.episodes["cost"])
        np.testing.assert_array_equal(costs[:count], one.evaluations["cost"])
        np.testing.assert_array_equal(theta[::10][:count], one.evaluations["theta"])
        assert np.isnan(costs[count:]).all()
        np.testing.assert_array_equal(theta[1:], one.episodes["theta"])


@pytest.mark.parametrize(
    "layouts", [("D",), pytest.param(design.LAYOUTS, marks=pytest.mark.slow)], ids=len
)
def test_a_page_is_given_one_seed_and_a_file_has_every_run_of_a_layout(layouts, monkeypatch):
    """To compress a layout takes seconds."""
    shown = unpacked(given("runs")["given"])
    learners, decays = ("DES", "RDES", "frozen"), ("step", "episode")
    assert set(shown) == {(learner, decay, 0) for learner in learners for decay in decays}
    assert_published(shown, "A")
    monkeypatch.setattr(published_runs, "LAYOUTS", layouts)
    files = published_runs.scripts()
    assert list(files) == [f"runs_{layout}.js" for layout in layouts]
    parts = (*design.main_table(), *design.controls())
    for layout, text in zip(layouts, files.values(), strict=True):
        runs = unpacked(json.loads(re.search(rf"{layout}: (.*) }};", text)[1]))
        assert set(runs) == {(e.learner, e.decay, e.seed) for e in parts if e.layout == layout}
        assert_published(runs, layout)
    assert sum(map(len, files.values())) < 5e6
