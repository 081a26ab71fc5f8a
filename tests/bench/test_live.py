"""The benchmark of the live figures: what it asks of a page, and its targets."""

import sys
from contextlib import nullcontext

import pytest

from nmpcrl.bench import live
from nmpcrl.bench.live_targets import live_targets
from nmpcrl.study.refusal import Refusal

MET = {
    "page": [40.0, 42.0, 90.0],
    "native": [35.0, 35.0, 80.0],
    "drag": [10.0] * 19 + [30.0],
    "fit": [0.4, 0.5, 3.0],
    "runs": {"ES": {"page": 3.0, "native": 2.0}, "GES": {"page": 3.0, "native": 2.0}},
    "weights": {"01.html": 150_000, live.LABORATORY: 900_000},
    "requests": {"01.html": 0},
    "errors": {"01.html": 0},
    "first": {"01.html": 200.0, "02.html": 250.0},
}
MISSED = {
    "native": [20.0, 20.0, 20.0],
    "drag": [10.0] * 10 + [50.0] * 10,
    "fit": [0.9, 1.1, 1.2],
    "runs": {"ES": {"page": 4.0, "native": 2.0}, "GES": {"page": 4.0, "native": 2.0}},
    "weights": {"01.html": 250_000},
    "requests": {"01.html": 1},
    "errors": {"01.html": 0, "02.html": 2},
    "first": {"01.html": 500.0},
}
PAGE = """<!doctype html><html lang="en"><head><title>A page</title></head><body>
<script src="_static/live/a.js"></script><script src="_static/live/a.js?v=1"></script>
<figure class="live" hidden><script type="application/json">{
"problem": {"discs": [], "target": [0], "lower": [0]}, "start": [0], "theta": [1],
"fields": [{"name": "alpha", "default": 1}], "layouts": {"A": []}, "steps": 2,
"widths": []}</script></figure></body></html>"""
SCRIPT = """
const figure = document.querySelector("figure.live")
figure.hidden = false
figure.innerHTML += "<svg width=100 height=100><circle role=slider r=20 cx=50 cy=50></circle></svg>"
let due = false
const draw = () => { due = false; figure.shown = {} }
addEventListener("pointermove", () => { if (!due) requestAnimationFrame(draw); due = true })
draw()
window.nmpcrl = {
  module: "", solver: async () => ({ wasm: {}, rollout: () => ({ failed: false }) }),
  generator: () => 0, network: (_, { inputs }) => ({
    remember(row) { if (row.length !== inputs || inputs !== 3) throw new Error("other inputs") },
    fit: () => 0,
  }),
  trainer: ({ settings }, { end }) => end(settings.episodes === 300 ? "" : "other episodes"),
}
console.error("an error")
fetch("http://localhost:9/").catch(() => 0)
"""


@pytest.fixture
def pages(tmp_path):
    """Two pages with a live figure that answers as ours do, and one without."""
    folder = tmp_path / "html/book"
    (folder / "_static/live").mkdir(parents=True)
    (folder / "_static/live/a.js").write_text(SCRIPT)
    for name in ("01.html", live.LABORATORY):
        text = PAGE.replace("</body>", '<script src="_static/live/a.js"></script></body>')
        (folder / name).write_text(text.replace(PAGE.splitlines()[1], ""))
    (folder / "02.html").write_text("<figure></figure>")
    return tmp_path / "html"


@pytest.mark.parametrize("found", [MET, MET | MISSED, {}], ids=["met", "missed", "nothing"])
def test_targets_are_reached_missed_or_not_measured(found):
    outcomes = [one.outcome for one in live_targets(found)]
    if not found:
        assert outcomes == ["not measured"] * 9
    else:
        assert outcomes == ["reached" if found is MET else "missed"] * 9


def test_ratios_are_medians_of_turns_so_that_one_disturbed_turn_changes_nothing():
    solve = live_targets(MET)[0]
    assert solve.measured == "1.14x (42 µs, 35 µs)"
    weight = live_targets(MET)[5]
    assert weight.measured == "150 kB (01.html)"  # the laboratory is no chapter


def test_a_page_weighs_its_figures_and_each_of_its_files_once(pages):
    (pages / "book/03.html").write_text(PAGE)
    inside = PAGE[PAGE.index("<figure") : PAGE.index("</figure>") + len("</figure>")]
    assert live.weight(pages / "book/03.html") == len(inside) + len(SCRIPT)


def test_all_is_measured_in_a_real_browser_and_stored(pages, browser, tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    trained = []
    monkeypatch.setattr(live, "run", trained.append)
    monkeypatch.setattr(live, "TURNS", 2)
    monkeypatch.setattr(live, "chromium", lambda: nullcontext(browser))
    found = live.measure(pages)
    assert found == live.stored()
    assert set(found) == {*MET, "date"}
    assert set(found["weights"]) == {"01.html", live.LABORATORY}
    assert len(found["page"]) == len(found["native"]) == len(found["fit"]) == 2
    assert min(found["native"]) > 0
    assert len(found["drag"]) > live.MOVES / 4
    assert found["requests"] == {"01.html": 1, live.LABORATORY: 1}
    assert all(count >= 1 for count in found["errors"].values())
    assert [e.learner for e in trained if e.episodes == 300] == ["ES", "GES"]
    assert "not measured" not in [one.outcome for one in live_targets(found)]


def test_without_pages_playwright_or_chromium_it_is_one_sentence(pages, tmp_path, monkeypatch):
    with pytest.raises(Refusal, match="no page with a live figure is built in"):
        live.measure(tmp_path)
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "playwright.sync_api", None)
        with pytest.raises(Refusal, match="playwright, which is not installed"):
            live.measure(pages)
    monkeypatch.setattr(live.shutil, "which", lambda _: None)
    with pytest.raises(Refusal, match="in Chromium: none of chromium"):
        live.measure(pages)


def test_what_is_stored_may_be_damaged(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    assert live.stored() == {}
    live.path().write_text("{")
    assert live.stored() == {}
