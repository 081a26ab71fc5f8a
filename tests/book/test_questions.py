"""Exercises on a page: what the driver makes of them, and what a reader can do with them."""

import json
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from driver.page import questions
from nbformat.v4 import new_notebook, new_output
from small_course import exercise

from nmpcrl.course import choice, number

STATIC = Path(__file__).resolve().parents[2] / "book/_static"
RIGHT = {
    "weight": number(2.5, 2.5, unit="kg", mistakes={5.0: "That is </script> twice as much."}),
    "reason": choice("b", "b", {"a": "Not a.", "b": "it is b.", "c": "Not c."}),
    "many": number(2600, 2600),
}
PAGE = """<!DOCTYPE html><html lang="en" data-theme="light"><head>
<meta charset="utf-8"><title>Exercises</title>
<link rel="stylesheet" href="{static}/nmpcrl.css">
<link rel="stylesheet" href="{static}/controls.css">
<link rel="stylesheet" href="{static}/exercises.css">
<script src="{static}/exercises.js"></script></head>
<body><main class="bd-article"><h1>Exercises</h1>{places}
<div class="exercise">Write code.</div></main></body></html>"""
AROUND = """<div class="exercise">How?</div>
<details class="folded"><summary>Hint 1 of {name}</summary><p>First.</p></details>
<details class="folded"><summary>Hint 2 of {name}</summary><p>Second.</p></details>
{place}<details class="folded"><summary>Solution</summary><p>So.</p></details>"""


def test_an_answer_that_can_be_typed_gets_a_place_above_its_folded_code():
    cells, shown = exercise("a"), RIGHT["weight"]._repr_mimebundle_()
    cells[2].outputs = [new_output("execute_result", shown, metadata={})]
    page = questions.placed(new_notebook(cells=cells))
    _, place, code, solution = page.cells
    assert code.source == "x = ...\n\ncheck.a(x)"
    assert "hide-input" in code.metadata["tags"]
    assert code.outputs == []
    assert "\n" not in place.source  # a blank line would end the HTML
    assert place.source.count("</script>") == 1
    assert 'data-exercise="a"' in place.source
    assert solution.source.endswith("\n\nThus.\n\n```python\nx = 2\n```\n\n</details>")


def written(folder: Path) -> str:
    """A page with an exercise of each kind, whose scripts are those of the book."""
    places = []
    for k, (name, outcome) in enumerate(RIGHT.items(), 1):
        data = json.dumps(dict(outcome.page)).replace("<", "\\u003c")
        place = questions.PLACE.format(name=name, number=f"1.{k}", data=data)
        places.append(AROUND.format(name=name, place=place))
    folder_of = STATIC.as_uri()
    page = PAGE.format(static=folder_of, places="\n".join(places))
    (folder / "page.html").write_text(page)
    return (folder / "page.html").as_uri()


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    return written(tmp_path_factory.mktemp("page"))


@pytest.fixture
def tab(browser, address):
    """The page, opened from disk by a reader who has not been here."""
    context = browser.new_context(viewport={"width": 390, "height": 900})
    page = context.new_page()
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.goto(address)
    yield page
    assert page.errors == []
    context.close()


def said(tab, name: str):
    return tab.locator(f'[data-exercise="{name}"] .said')


def answered(tab, name: str, answer: str) -> str:
    """What is said of an answer that is typed and sent by the Enter key."""
    tab.locator(f"#answer-{name}").fill("")
    tab.locator(f"#answer-{name}").press_sequentially(answer)
    tab.keyboard.press("Enter")
    return said(tab, name).inner_text()


@pytest.mark.parametrize(
    ("name", "answer", "what"),
    [
        ("weight", "2.5", "Right: 2.5 kg."),
        *(("weight", one, "Right: 2.5 kg.") for one in ("2,505", "25e-1", "2.5 kg", "250 %")),
        *(("weight", one, "Right: 2.5 kg.") for one in ("25·10⁻¹", "0.25*10^1", "2,500")),
        ("many", "2600", "Right: 2600."),
        ("weight", "5", "That is </script> twice as much. The next hint is open above."),
        ("weight", "-2.5", "Not right: look at the sign."),
        ("weight", "250", "Not right: it is too large by a power of ten."),
        ("weight", "2.5 %", "Not right: it is too small by a power of ten."),
        ("weight", "2", "Not right: it is too small."),
    ],
)
def test_a_typed_answer_is_judged_as_the_notebook_judges_it(tab, name, answer, what):
    assert answered(tab, name, answer).startswith(what) or what in said(tab, name).inner_text()
    verdict = tab.locator(f'[data-exercise="{name}"]').get_attribute("data-verdict")
    assert verdict == ("right" if what.startswith("Right") else "wrong")


@pytest.mark.parametrize("answer", ["much", "", "1/0"])
def test_what_cannot_be_read_costs_nothing(tab, answer):
    answered(tab, "weight", "2.5")
    assert answered(tab, "weight", answer) == "That cannot be read as a number."
    assert tab.locator('[data-exercise="weight"]').get_attribute("data-verdict") == ""
    assert tab.locator("details[open]").count() == 0


def test_the_keyboard_alone_chooses_and_checks(tab):
    tab.locator("#answer-reason-a").focus()
    tab.keyboard.press("Space")
    tab.keyboard.press("Enter")
    assert said(tab, "reason").inner_text().startswith("Not a.")
    tab.keyboard.press("ArrowDown")  # b
    tab.keyboard.press("Tab")
    assert tab.evaluate("document.activeElement.innerText") == "Check"
    tab.keyboard.press("Enter")
    assert said(tab, "reason").inner_text() == "Right: it is b."


def test_each_miss_opens_the_next_hint_and_the_last_answer_of_each_exercise_is_kept(tab):
    opened = "[...document.querySelectorAll('details[open] summary')].map(one => one.innerText)"
    assert tab.evaluate(opened) == []
    assert "next hint is open" in answered(tab, "weight", "1")
    assert tab.evaluate(opened) == ["Hint 1 of weight"]
    assert "next hint is open" in answered(tab, "weight", "1")
    assert tab.evaluate(opened) == ["Hint 1 of weight", "Hint 2 of weight"]
    assert "next hint" not in answered(tab, "weight", "1")
    answered(tab, "weight", "2.5")
    answered(tab, "many", "7")
    tab.reload()
    assert tab.locator("#answer-weight").input_value() == "2.5"
    assert said(tab, "weight").inner_text() == "Right: 2.5 kg."
    assert said(tab, "many").inner_text().startswith("Not right")


@pytest.mark.parametrize("stored", ["{", "[]", '{"weight": 3}'])
def test_what_is_stored_may_be_spoilt(tab, stored):
    tab.evaluate("stored => localStorage.setItem('nmpcrl.exercises', stored)", stored)
    tab.reload()
    assert answered(tab, "weight", "2.5") == "Right: 2.5 kg."


def test_a_browser_that_keeps_nothing_still_checks(tab):
    tab.add_init_script("Storage.prototype.setItem = () => { throw new Error('full') }")
    tab.reload()
    assert answered(tab, "weight", "2.5") == "Right: 2.5 kg."


@pytest.mark.parametrize("width", [390, 1400])
def test_no_rule_of_accessibility_is_broken(tab, width):
    tab.set_viewport_size({"width": width, "height": 900})
    answered(tab, "weight", "5")
    found = Axe().run(tab, options={"resultTypes": ["violations"], "preload": False})
    assert [one["id"] for one in found.response["violations"]] == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= width


def test_without_scripts_and_on_paper_there_is_no_place_to_type(browser, address, tab):
    without = browser.new_context(java_script_enabled=False)
    page = without.new_page()
    page.goto(address)
    assert not page.locator(".answer").first.is_visible()
    assert page.get_by_text("Solution").first.is_visible()
    without.close()
    tab.emulate_media(media="print")
    assert not tab.locator(".answer").first.is_visible()
