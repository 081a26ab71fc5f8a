"""What a deck shows of a unit, and what it says."""

import re
from dataclasses import replace

import nbformat
import pytest
from driver import project
from driver.course import deck, slides
from driver.teaching.plans import LIVE, plan
from driver.teaching.syllabus import chapters
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

UNITS = {name: (text, unit) for name, text, unit in slides.units()}
UNIT = plan(slides.PLAN)[0]
PAGE = UNIT.sections[0].page
SAY = 'say("It costs {cost:.1f} of $x_{max}$, or {share:.0%}.", cost=cost, share=share)'
REFERENCE = re.compile(r"!\[.*?\]\((?:(\w+)\.ipynb)?#([\w-]+)\)")
DIGITS = re.compile(
    r"!\[.*?\]\(.*?\)|(?s:\$\$.*?\$\$)|\$.*?\$|^\d\. |paper's \(\d+\)|C\d|Figure \d|Table II",
    flags=re.M,
)

each_unit = pytest.mark.parametrize(("text", "unit"), UNITS.values(), ids=UNITS)


def executed(*cells):
    return new_notebook(cells=list(cells))


def code(name: str, source: str = "1", **data: str):
    kind = {key.replace("_", "/"): value for key, value in data.items()}
    outputs = [new_output("display_data", data=kind)] if data else []
    return new_code_cell(source, id=name, outputs=outputs)


def made(text: str, *cells) -> deck.Deck:
    text = f"# {UNIT.title}\n\nWhy?\n\nSo.\n\n> Begin.\n\n{text}\n\n## What was seen\n\n- All."
    return deck.deck(text, UNIT, {PAGE: executed(*cells)})


def taught(text: str, *cells) -> deck.Slide:
    """The slide of a text."""
    _, _, slide, _, _ = made(text, *cells).slides
    return slide


def test_a_deck_has_question_and_answer_goals_what_is_taught_exercises_and_what_was_seen():
    first, goals, slide, exercises, seen = made("## It moves\n\n- A").slides
    assert (first.title, first.shown) == (UNIT.title, ["<p>Why?</p>", "<p>So.</p>"])
    assert "are left for questions" in first.said[0]
    assert first.said[1] == "<p>Begin.</p>"
    assert UNIT.goals[0].split()[0] in "".join(goals.shown)
    assert slide.title == "It moves"
    assert all(one.number in "".join(exercises.shown) for one in UNIT.exercises)
    assert all(one.about.mistakes[0][:9] in "".join(exercises.said) for one in UNIT.exercises)
    assert seen.title == "What was seen"


def test_a_quotation_is_said_and_all_else_is_shown():
    slide = taught("## It moves\n\nShown.\n\n> Said. **Ask:** Why?\n\n- Listed")
    assert "Said" not in "".join(slide.shown)
    assert "<p>Said. <strong>Ask:</strong> Why?</p>" in slide.said
    assert "Listed" in slide.shown[1]


def test_a_formula_comes_from_its_label_and_a_link_becomes_words():
    cell = new_markdown_cell('Text.\n\n<a id="eq-own"></a>\n$$\na < b\n$$\n\nMore.', id="text")
    slide = taught("## It moves\n\n![](#eq-own)\n\nSee [Chapter 2](02.ipynb).", cell)
    assert "a &lt; b" in slide.shown[0]
    assert "More" not in slide.shown[0]
    assert slide.shown[1] == "<p>See Chapter 2.</p>"


def test_of_a_text_its_table_is_shown_and_of_a_cell_what_it_displays():
    text = new_markdown_cell("Words.\n\n| a | b |\n|---|---|\n| 1 | 2 |", id="text")
    slide = taught("## It moves\n\n![](#text)\n\n![](#cell)", text, code("cell", text_plain="<1>"))
    assert "Words" not in "".join(slide.shown)
    assert slide.shown[0].startswith("<table>")
    assert slide.shown[1] == "<pre>&lt;1&gt;</pre>"


def test_of_a_table_the_rows_are_shown_whose_first_cell_has_one_of_the_words():
    text = new_markdown_cell("| a | b |\n|---|---|\n| ES with x | 2 |\n| GES | ES |", id="text")
    slide = taught("## It moves\n\n![ES RDES](#text)", text)
    assert "<th>a</th>" in slide.shown[0]
    assert "ES with x" in slide.shown[0]
    assert "GES" not in slide.shown[0]


def test_another_page_is_shown_by_its_name():
    own, other = code("own", text_plain="1"), code("it", text_plain="2")
    pages = {PAGE: executed(own), "other": executed(other)}
    shown = "## It moves\n\n![](#own)\n\n![](other.ipynb#it)"
    text = f"# A\n\nWhy?\n\n{shown}\n\n## What was seen\n\n- All."
    assert deck.pages(text, UNIT) == [*pages]
    assert deck.deck(text, UNIT, pages).slides[2].shown == ["<pre>1</pre>", "<pre>2</pre>"]


def test_a_number_is_what_the_cell_says_in_the_place_of_its_name():
    cell = code("end-said", SAY, text_markdown="It costs 2.5 of $x_{max}$, or 31%.")
    slide = taught("## It moves\n\n{end-said.cost}, {end-said.share}\n\n> {end-said.cost}", cell)
    assert slide.shown == ["<p>2.5, 31%</p>"]
    assert slide.said[-1] == "<p>2.5</p>"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("![](#eq-none)", "has no formula eq-none"),
        ("![](#none)", "has no cell none"),
        ("![](#bare)", "bare of .* has no output"),
        ("{said.cost}", "says no cost"),
    ],
)
def test_what_a_chapter_lacks_is_refused_in_a_sentence(text, words):
    with pytest.raises(deck.NotThere, match=words):
        made(f"## It moves\n\n{text}", code("bare"), code("said", SAY, text_markdown="Else."))


def test_slides_share_the_minutes_of_the_lecture_and_a_live_figure_has_its_own():
    figure = '<style data-file="a.css">\np\n</style><figure class="live"></figure>'
    parts = "## It moves\n\nA\n\n## It turns\n\n![](#live)\n\n## It stops\n\nB"
    built = made(parts, code("live", text_html=figure))
    lecture = UNIT.minutes["lecture"] / 2
    ends = [lecture, lecture + LIVE, 2 * lecture + LIVE]
    for slide, end in zip(built.slides[2:5], ends, strict=True):
        assert f"to {end:.0f}." in slide.said[0]
    assert built.files == {"live/a.css": b"p"}


def test_a_figure_that_is_too_high_is_drawn_for_slides():
    shown = {"finding": "Up", "wide": {"svg": "wide"}, "slide": {"svg": "low"}}
    cell = code("fig", image_png="UE5H", **{"application/vnd.nmpcrl.figure+json": shown})
    cell.metadata["mystnb"] = {"image": {"alt": "A line."}}
    built = made("## It moves\n\n![](#fig)", cell)
    assert built.files == {f"{PAGE}/fig.svg": b"low"}
    assert 'alt="Up. A line."' in built.slides[2].shown[0]


# The texts


def test_every_unit_that_teaches_sections_has_a_deck_and_every_deck_a_unit():
    assert [unit.title for unit in plan(slides.PLAN) if unit.sections] == [
        unit.title for _, unit in UNITS.values()
    ]
    assert len(UNITS) == len(list(slides.TEXTS.glob("*.md"))) == 17


@each_unit
def test_a_deck_has_ten_to_fifteen_slides_whose_titles_are_sentences(text, unit):
    titles = re.findall(r"^## (.+)$", text, flags=re.M)
    assert 10 <= len(titles) + 3 <= 15
    assert titles.pop() == "What was seen"
    assert len(re.split(r"^## What was seen$", text, flags=re.M)[1].strip().splitlines()) == 3
    headings = {section.title for one in chapters().values() for section in one.sections}
    for title in titles:
        assert title not in headings
        assert len(title.split()) >= 4, title
        assert title[0].isupper(), title
    assert len({*titles}) == len(titles)


@each_unit
def test_a_deck_asks_at_least_twice_and_says_what_answers_to_expect(text, unit):
    questions = re.findall(r"\*\*Ask\b.*", text)
    assert len(questions) >= 2
    assert all("?" in one and "*Expect:*" in one for one in questions)
    assert all("\n> " in part for part in re.split(r"^##? ", text, flags=re.M)[1:-1])


@each_unit
def test_no_number_is_typed_on_a_slide(text, unit):
    """Outside formulas and names."""
    lines = [line for line in text.splitlines() if not line.startswith((">", "##"))]
    shown = deck.NUMBER.sub("", DIGITS.sub("", "\n".join(lines)))
    assert not re.findall(r".*\d.*", shown)


def cells_of(page: str) -> dict:
    notebook = nbformat.read(project.ROOT / "book" / f"{page}.ipynb", 4)
    return {cell.id: cell for cell in notebook.cells}


@each_unit
def test_a_deck_names_what_its_chapter_has_and_every_live_figure_of_the_unit(text, unit):
    page = unit.sections[0].page
    assert {one.page for one in unit.sections} == {page}
    cells = cells_of(page)
    sources = "".join(cell.source for cell in cells.values())
    for other, one in REFERENCE.findall(text):
        assert one in cells_of(other or page) or f'<a id="{one}"></a>' in sources, one
    for found in deck.NUMBER.finditer(text):
        assert (
            f"{found['name']}=" in cells[found["cell"]].source
            or "**" in cells[found["cell"]].source
        )
    shown = [one for other, one in REFERENCE.findall(text) if not other]
    live = [one for one in shown if one in cells and "live." in cells[one].source]
    assert len(live) == sum(section.live for section in unit.sections)


def test_a_chapter_that_was_not_executed_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(project.Failure, match=rf"{PAGE}.ipynb computes: `make book`"):
        slides.write("01", "", UNIT, tmp_path, tmp_path)


def test_a_deck_that_is_newer_than_the_build_is_refused_in_a_sentence(tmp_path):
    nbformat.write(executed(), tmp_path / f"{PAGE}.ipynb")
    text = "# A\n\n## It moves\n\n![](#new)\n\n## What was seen\n\n- All."
    with pytest.raises(project.Failure, match=r"decks/01.md: .* has no cell new"):
        slides.write("01", text, replace(UNIT), tmp_path, tmp_path)


def test_a_package_that_lacks_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(project.Failure, match=r"no_such_package of environment\.txt"):
        slides.copy("no_such_package", "", ("a",), tmp_path)
