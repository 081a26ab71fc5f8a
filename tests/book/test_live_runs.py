"""The figure of published runs: what a reader chooses, moves and plays, with published numbers."""

import re
from collections.abc import Iterable

import nbformat
import numpy as np
import pytest
from driver.page import live
from live_page import MOST, Tab

from nmpcrl.claims import published
from nmpcrl.study import Experiment

FIGURE = "runs"
CHAPTERS = ("05_results", "07_beyond")
SAME = 1e-6  # relative: theta is published in single precision, which moves the cost by 1e-7
EARLIER = 1e-3  # of runs that an earlier solver made
SLIDER = "Episode"
HOLDS = "figure => figure.shown.given.episode"
UNDERWAY = """() => {
  const { episode } = document.querySelector("[data-figure=runs]").shown.given;
  return episode >= 3 && episode < 300;
}"""

LOSES_C = """
  const real = Element.prototype.setAttribute
  Element.prototype.setAttribute = function (name, value) {
    real.call(this, name, String(value).replace("runs_C", "nowhere"))
  }"""


@pytest.fixture(scope="module")
def known():
    return published.load()


def choose(tab: Tab, **values: str) -> dict:
    """Choose in the selects, by their labels, and wait for the runs."""
    for label, value in values.items():
        tab.figure.get_by_label(label.replace("_", " "), exact=True).select_option(value)
    layout, seed = values.get("Layout"), values.get("Seed")
    tab.page.wait_for_function(
        """([layout, seed]) => {
          const { given } = document.querySelector("figure.live[data-figure=runs]").shown;
          return (!layout || given.layout === layout) && (!seed || given.seed === Number(seed));
        }""",
        arg=[layout, seed],
    )
    return tab.shown()


def further(addresses: Iterable[str]) -> list[str]:
    """The files with all runs of a layout among these."""
    names = [address.rpartition("/")[2] for address in addresses]
    return [name for name in names if re.fullmatch(r"runs_[A-F]\.js", name)]


def assert_equal_to_published(shown: dict, known) -> None:
    given = shown["given"]
    episode = given["episode"]
    for one in shown["found"]:
        cell = {name: given[name] for name in ("layout", "decay", "seed")}
        run = known.summaries[Experiment(one["learner"], **cell)]
        np.testing.assert_array_equal(one["run"]["training"], run.episodes["cost"])
        at, rest = divmod(episode, 10)
        if rest:
            assert one["theta"] == run.episodes["theta"][episode - 1].tolist()
            assert one["judged"] == one["cost"]
        else:
            assert one["theta"] == run.evaluations["theta"][at].tolist()
            assert one["judged"] == run.evaluations["cost"][at]
        within = SAME if known.is_current("main") else EARLIER
        assert one["cost"] == pytest.approx(one["judged"], rel=within)
        assert not one["failed"]


def notebook_of(*outputs: str) -> nbformat.NotebookNode:
    shown = [nbformat.v4.new_output("display_data", {"text/html": html}) for html in outputs]
    return nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("x", outputs=shown)])


def test_the_files_of_runs_are_written_if_a_figure_asks_for_them(tmp_path):
    live.add_runs([notebook_of("<p>none</p>"), notebook_of()], tmp_path)
    assert list(tmp_path.iterdir()) == []
    live.add_runs([notebook_of("<p>none</p>", '<figure data-figure="runs">')], tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"runs_{k}.js" for k in "ABCDEF"]


def test_it_begins_with_published_numbers_and_has_loaded_no_further_runs(tab, known):
    shown = tab.shown()
    assert shown["given"]["episode"] == 300
    assert [one["learner"] for one in shown["found"]] == ["ES", "DES", "frozen"]
    assert_equal_to_published(shown, known)
    assert further(tab.requests) == []


def test_every_choice_shows_its_published_run_whose_trajectory_the_page_solves(tab, known):
    chosen = {"Learner": "GES", "Beside_it": "TDC", "Layout": "D", "Noise_decays": "episode"}
    shown = choose(tab, **chosen, Seed="7")
    assert [one["learner"] for one in shown["found"]] == ["GES", "TDC", "frozen"]
    assert_equal_to_published(shown, known)
    for one in shown["found"]:
        run = known.summaries[Experiment(one["learner"], layout="D", decay="episode", seed=7)]
        np.testing.assert_allclose(one["states"], run.states, atol=1e-3)
    said = tab.figure.locator("[role=status]").inner_text()
    for one in shown["found"]:
        assert f"{one['judged']:.1f}" in said
        assert f"{one['training']:.1f}" in said
    assert further(tab.requests) == ["runs_D.js"]


def test_keys_move_episode_by_episode(tab, known):
    tab.press(SLIDER, "ArrowLeft", "ArrowLeft", "ArrowLeft")
    shown = tab.shown()
    assert shown["given"]["episode"] == 297
    assert tab.handle(SLIDER).get_attribute("aria-valuetext") == "episode 297"
    assert_equal_to_published(shown, known)
    tab.press(SLIDER, "Home")
    shown = tab.shown()
    es, des, frozen = (one["states"] for one in shown["found"])
    assert es == des == frozen
    assert "before training" in tab.figure.locator("[role=status]").inner_text()
    x = tab.figure.locator(".cursor").first.get_attribute("x1")
    assert float(x) == 0


def test_a_click_on_the_slider_moves_there(tab):
    tab.handle(SLIDER).scroll_into_view_if_needed()
    box = tab.handle(SLIDER).bounding_box()
    tab.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert tab.shown()["given"]["episode"] == pytest.approx(150, abs=2)


def test_play_goes_from_the_first_episode_on_until_it_is_paused(tab):
    tab.click("Play")
    tab.page.wait_for_function(UNDERWAY)  # it begins where the last run ends
    tab.click("Pause")
    held = tab.shown()["given"]["episode"]
    assert 3 <= held < 300
    tab.later(60)
    assert tab.shown()["given"]["episode"] == held
    tab.press(SLIDER, "End", "ArrowLeft")
    tab.click("Play")
    tab.page.wait_for_function(f"({HOLDS})(document.querySelector('[data-figure=runs]')) === 300")
    assert tab.figure.get_by_role("button", name="Play", exact=True).count() == 1


def test_the_slider_takes_over_from_play(tab):
    tab.press(SLIDER, "Home")
    tab.click("Play")
    tab.press(SLIDER, "End", "ArrowLeft")
    tab.later(60)
    assert tab.shown()["given"]["episode"] == 299


def test_one_run_may_be_shown_alone_beside_the_frozen_arm(tab):
    shown = choose(tab, Beside_it="")
    assert [one["learner"] for one in shown["found"]] == ["ES", "frozen"]
    assert tab.figure.locator("polyline.learner").count() == 2
    assert tab.figure.locator(".key span").all_inner_texts() == ["ES", "frozen arm"]


def test_a_run_that_was_stopped_ends_where_it_was(tab, known):
    e = Experiment("DES", layout="A", decay="step", seed=3)
    count = len(known.summaries[e].evaluations["cost"])
    shown = choose(tab, Seed="3")
    assert shown["found"][1]["states"] == []
    said = "DES: this run was stopped before episode 300."
    assert said in tab.figure.locator("[role=status]").inner_text()
    last = 10 * (count - 1)
    tab.press(SLIDER, "Home", *["ArrowRight"] * last)
    shown = tab.shown()
    assert shown["given"]["episode"] == last
    assert_equal_to_published(shown, known)


def test_a_layout_whose_runs_cannot_be_loaded_says_so(opened):
    tab = opened(FIGURE, script=LOSES_C)
    tab.begun().figure.get_by_label("Layout", exact=True).select_option("C")
    tab.figure.get_by_text("could not be loaded").wait_for()


def test_a_run_that_was_not_made_is_named(opened):
    tab = opened(FIGURE, chapter="07_beyond").begun()
    shown = choose(tab, Learner="QL", Layout="B")
    assert [one["learner"] for one in shown["found"]] == ["TDC", "frozen"]
    assert "There is no run of Q-learning in layout B" in tab.figure.inner_text()


def test_a_notebook_has_one_seed_in_one_layout_and_asks_for_nothing(browser, site, tmp_path):
    notebook = nbformat.read(site / "book/05_results.ipynb", 4)
    (html,) = [text for text in live.shown(notebook) if live.ASKS in text]
    page = browser.new_page()
    requests = []
    page.on("request", lambda request: requests.append(request.url))
    (tmp_path / "output.html").write_text(f"<!DOCTYPE html><meta charset='utf-8'>{html}")
    page.goto((tmp_path / "output.html").as_uri())
    page.locator("figure.live .results b").first.wait_for()
    assert page.get_by_label("Layout").locator("option").all_inner_texts() == ["A"]
    assert page.get_by_label("Seed").locator("option").all_inner_texts() == ["0"]
    page.get_by_label("Noise decays").select_option("episode")
    page.wait_for_function("document.querySelector('figure.live').shown.given.decay === 'episode'")
    assert len(requests) == 1
    page.close()


@pytest.mark.parametrize("chapter", CHAPTERS)
def test_what_a_page_loads_at_first_is_light(site, chapter):
    text = (site / f"book/{chapter}.html").read_text()
    files = [path for path in site.glob("_static/live/*") if f"_static/live/{path.name}" in text]
    given = len(text.partition('data-figure="runs"')[2].partition("</figure>")[0])
    assert sum(path.stat().st_size for path in files) + given <= MOST
    assert further(path.name for path in files) == []
