"""What a deck shows of a chapter, and what it says."""

import re

import pytest
from driver import build
from driver.course import course, deck, slides
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output


def notebook(*cells):
    title = new_markdown_cell("# A question\n\nAnswered here. And there.", id="title")
    return new_notebook(cells=[title, *cells])


def text(source: str, *tags: str):
    return new_markdown_cell(source, id=f"cell-{len(source)}", metadata={"tags": list(tags)})


def made(*cells) -> list[deck.Slide]:
    source = notebook(*cells)
    return deck.deck("chapter", source, source).slides


def test_a_deck_begins_with_the_title_and_ends_with_the_exercises():
    first, last = made(text("Not chosen."))
    assert (first.title, first.shown) == ("A question", ["<p>Answered here.</p>"])
    assert "<p>Answered here. And there.</p>" in first.said
    assert last.title == "Exercises"


def test_of_a_text_the_first_sentence_and_the_formulas_are_shown_and_all_of_it_is_said():
    _, slide, _ = made(text("## Head\n\nOne. Two.\n\n$$\na < b\n$$\n\nThree.", "slide"))
    assert slide.title == "Head"
    assert slide.shown[0] == "<p>One.</p>"
    assert r"\[" in slide.shown[1]
    assert "a &lt; b" in slide.shown[1]
    assert slide.said == ["<p>One. Two.</p>", "<p>Three.</p>"]


def test_a_slide_has_the_heading_it_stands_under_and_each_heading_begins_a_slide():
    _, one, two, three, _ = made(
        text("## Before"), text("Text.", "slide"), text("## A\n\nB.\n\n### C\n\nD.", "slide")
    )
    assert [slide.title for slide in (one, two, three)] == ["Before", "A", "C"]
    assert two.name != three.name


def test_fragments_and_notes_join_the_slide_before_them():
    _, slide, _ = made(text("## A", "slide"), text("- b", "fragment"), text("C, d.", "notes"))
    assert 'class="fragment"' in slide.shown[0]
    assert slide.said == ["<p>C, d.</p>"]


def test_links_become_words():
    _, slide, _ = made(text("See [Chapter 2](02_expected_sarsa.ipynb).", "slide"))
    assert slide.shown == ["<p>See Chapter 2.</p>"]


def test_a_chosen_cell_that_was_not_executed_is_refused():
    cell = new_code_cell("1", id="bare", metadata={"tags": ["slide"]})
    with pytest.raises(deck.Unexecuted, match="bare"):
        made(cell)
    cell.outputs = [new_output("execute_result", data={"text/plain": "<1>"})]
    assert made(cell)[1].shown == ["<pre>&lt;1&gt;</pre>"]


def test_a_chapter_that_was_not_executed_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(build.Failure, match=r"01.ipynb computes: `make book`"):
        slides.write("01.ipynb", notebook(), tmp_path, tmp_path)


def test_a_package_that_lacks_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(build.Failure, match=r"no_such_package of environment\.txt"):
        slides.copy("no_such_package", "", ("a",), tmp_path)


RELATION = re.compile(r"=|&lt;|&gt;|\\(le|ge|leq|geq|approx|sim|in|leftarrow|to|min|max)\b")


@pytest.mark.parametrize(("name", "source"), course.chapters().items())
def test_every_formula_of_a_slide_says_what_it_is_equal_to(name, source):
    """The sentence around it, which often has its left side, is for the speaker."""
    markdown = [cell for cell in source.cells if cell.cell_type == "markdown"]
    read = new_notebook(cells=markdown)
    shown = [html for slide in deck.deck(name, read, read).slides for html in slide.shown]
    for formula in re.findall(r"\\\[.*?\\\]", "".join(shown), flags=re.S):
        assert RELATION.search(formula), formula
