"""What a course takes: minutes that are computed, plans that fit, links that lead somewhere."""

import json
import re
from pathlib import Path

import pytest
import yaml
from driver import project
from driver.teaching import graph, plans, self_test, syllabus, teaching
from driver.teaching.declared import declared
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

BOOK = Path(__file__).resolve().parents[2] / "book"
CHAPTERS = syllabus.chapters()
PLANS = declared().plans
SECTIONS = {one.label for chapter in CHAPTERS.values() for one in chapter.sections}
LABELS = SECTIONS | {syllabus.label(page, "Exercises") for page in CHAPTERS}

each_chapter = pytest.mark.parametrize("page", CHAPTERS)
each_plan = pytest.mark.parametrize("name", PLANS)


def notebook(*cells):
    return new_notebook(cells=[new_markdown_cell("# What?"), *cells])


def read(*cells):
    return syllabus.chapter("01_a", 1, notebook(new_markdown_cell("## One"), *cells))


@pytest.mark.parametrize(
    ("cell", "seconds"),
    [
        (new_markdown_cell("word " * syllabus.WORDS), 60),
        (new_markdown_cell("$$\nx\n$$\n\n$$\ny\n$$"), 2 * syllabus.FORMULA),
        (new_code_cell('say("' + "word " * (syllabus.WORDS - 1) + '")'), 60),
        (new_code_cell("draw()", metadata={"mystnb": {}, "tags": ["hide-input"]}), syllabus.FIGURE),
        (new_code_cell("x = 1"), syllabus.CODE),
        (new_code_cell("x = 1", metadata={"tags": ["hide-input"]}), 0),
        (new_markdown_cell("word " * 500, metadata={"tags": ["solution"]}), 0),
    ],
)
def test_words_formulas_figures_and_code_take_time_to_read(cell, seconds):
    (section,) = read(cell).sections
    headline = 60 / syllabus.WORDS  # "One"
    assert section.seconds == pytest.approx(seconds + headline)


def test_two_headings_in_one_cell_begin_two_sections():
    first, second = read(new_markdown_cell("text\n\n## Two, $x$\n\nmore")).sections
    assert (first.title, second.title) == ("One", "Two, $x$")
    assert second.label == "section-a-two-x"


def test_a_live_figure_belongs_to_the_section_that_shows_it():
    chapter = read(new_code_cell("live.chain(1)"), new_markdown_cell("## Two"))
    assert [one.live for one in chapter.sections] == [1, 0]


@each_chapter
def test_a_chapter_says_at_its_head_what_it_takes_and_needs(page):
    chapter, head = CHAPTERS[page], teaching.head(CHAPTERS[page])
    assert f"Reading {chapter.reading} min" in head
    work = [one.about for one in chapter.exercises if one.about.kind != "project"]
    if work:
        assert f"exercises {sum(about.minutes for about in work)} min" in head
    for needed in chapter.needs:
        assert CHAPTERS[needed.page].link in head


def test_the_head_follows_the_title_and_each_section_gets_its_label():
    cells = [new_markdown_cell("text\n\n## States, actions, costs\n\nmore"), new_code_cell("## no")]
    page = notebook(*cells)
    page.cells[0].source += "\n\nWhy?"
    teaching.headed(page, "01_mdp_and_nmpc")
    title, text, code = page.cells
    assert title.source.startswith("# What?\n\n{.chapter-head}\nReading ")
    assert title.source.endswith(".\n\nWhy?")
    assert "(section-mdp-and-nmpc-states-actions-costs)=\n## States, actions, costs" in text.source
    assert code.source == "## no"


def test_no_two_sections_have_one_label():
    every = [one for chapter in CHAPTERS.values() for one in chapter.sections]
    assert len(SECTIONS) == len(every)


def test_the_syllabus_knows_every_numbered_chapter_and_no_other():
    assert set(declared().chapters) == set(CHAPTERS)
    with pytest.raises(syllabus.Unknown, match="does not say what 99_more needs"):
        declared().place("99_more")
    with pytest.raises(syllabus.Unknown, match="04_ges has no section 'Nothing'"):
        CHAPTERS["04_ges"].section("Nothing")


@each_chapter
def test_a_section_that_is_needed_stands_in_an_earlier_chapter(page):
    for one in CHAPTERS[page].needs:
        assert CHAPTERS[one.page].number < CHAPTERS[page].number
    assert [one.title for one in CHAPTERS[page].alone] == list(declared().place(page).alone)


@each_plan
def test_every_unit_fits_into_its_minutes_and_the_table_adds_them_up(name):
    units = plans.plan(name)
    for unit in units:
        assert 0 < unit.total <= plans.UNIT - 8, unit.title  # for questions
        assert unit.goals
    *rows, last = teaching.overview(name).splitlines()[2:]
    sums = [int(row.split("|")[-2]) for row in rows]
    assert sums == [unit.total for unit in units]
    assert int(last.split("|")[-2]) == sum(sums)


def test_the_plans_are_as_long_as_they_say():
    assert {name: len(units) for name, units in PLANS.items()} == {"two-weeks": 18, "weekend": 6}
    text = (BOOK / "teach.md").read_text()
    assert f"Eighteen units of {plans.UNIT} minutes" in text
    assert f"Six units of {plans.UNIT} minutes" in text


def test_the_seminar_takes_what_the_page_and_the_plans_say():
    _, _, seminar = (BOOK / "teach.md").read_text().partition("## A seminar")
    steps = [int(n) for n in re.findall(r"^\| (\d+) \|", seminar, flags=re.M)]
    assert sum(steps) == plans.UNIT
    for name in PLANS:
        (unit,) = (one for one in plans.plan(name) if one.title.startswith("Seminar"))
        assert unit.discussion.minutes == sum(steps[3:])
    assert f"and {sum(steps[3:])} minutes remain" in seminar


@each_plan
def test_each_section_is_taught_once_or_left_out_and_each_exercise_given_once(name):
    units = plans.plan(name)
    taught = [one.label for unit in units for one in unit.sections]
    left = [one.label for unit in units for one in unit.left_out]
    pages = {one.page for unit in units for one in unit.sections}
    assert sorted(taught + left) == sorted(
        one.label for page in pages for one in CHAPTERS[page].sections
    )
    given = [one.name for unit in units for one in unit.exercises + unit.homework]
    assert sorted(given) == sorted(
        one.name
        for page in pages
        for one in CHAPTERS[page].exercises
        if one.about.kind != "project"
    )


@each_plan
def test_a_chapter_is_taught_after_what_it_needs(name):
    taught: set[str] = set()
    for unit in plans.plan(name):
        pages = {one.page for one in unit.sections}
        for page in pages:
            for need in CHAPTERS[page].needs:
                assert need.page in taught | pages, unit.title
        taught |= pages


@pytest.mark.parametrize("part", ["needs", "path", "self-test", "units two-weeks", "units weekend"])
def test_every_link_of_a_part_leads_to_a_section_or_a_page(part):
    text = teaching.filled(f"<!-- syllabus: {part} -->")
    links = re.findall(r"\]\(([^()\s]+)\)", text)
    assert links
    own = set(re.findall(r'<a id="([^"]+)"', (BOOK / "teach.md").read_text()))
    for link in links:
        page, _, label = link.partition("#")
        assert not label or label in LABELS | own, link
        assert not page or page.startswith("https://") or (BOOK / page).exists(), link


@pytest.mark.parametrize("page", ["teach.md", "learn_alone.md"])
def test_a_page_names_parts_that_exist_and_all_are_filled(page):
    source = (BOOK / page).read_text()
    assert teaching.PART.search(source)
    assert "syllabus:" not in teaching.filled(source)
    with pytest.raises(KeyError):
        teaching.filled("<!-- syllabus: nothing -->")


def test_the_self_test_has_ten_questions_with_one_right_answer_each():
    asked = declared().self_test
    assert len(asked) == 10
    assert {one.right for one in asked} == {"a", "b", "c"}
    for number, one in enumerate(asked, 1):
        text = self_test.question(number, one)
        data = json.loads(re.search(r'json">(.*)</script>', text)[1])
        assert data["right"] == one.right
        assert data["why"] == {k: why for k, (_, why) in one.choices.items()}
        assert "Read: " in text


def test_the_entry_for_bibtex_says_what_the_citation_file_does():
    entry = yaml.safe_load((BOOK.parent / "CITATION.cff").read_text())
    for key in ("title", "version", "license"):
        assert str(entry[key]) in teaching.citation()


def test_a_graph_puts_each_chapter_below_what_it_needs_and_drops_what_follows():
    needs = {"a": [], "b": ["a"], "c": ["a", "b"]}
    assert graph.arranged(needs) == ([["a"], ["b"], ["c"]], {"a": [], "b": ["a"], "c": ["b"]})
    with pytest.raises(ValueError, match="need each other"):
        graph.arranged({"a": ["b"], "b": ["a"]})


def test_the_graph_names_every_chapter_and_says_in_words_what_needs_what():
    drawn = teaching.drawn()
    for page, chapter in CHAPTERS.items():
        assert f'href="{page}.html" aria-label="Chapter {chapter.number}: ' in drawn
    assert "2 needs 1; 3 needs 2; 4 needs 2; 5 needs 3 and 4" in drawn


PAGE = """<article><section><h1>One two<a class="headerlink">#</a></h1><p>three \\(x\\)
<span class="math">four</span></p><details><summary>Hint</summary>five</details>
<div class="admonition dropdown"><p class="admonition-title">Goals</p><div>six</div></div>
<pre>code()</pre><figure class="live">seven</figure>
<section><h2>Exercises</h2><p>eight</p></section></section></article>"""


def test_the_words_of_a_page_are_those_that_are_not_folded_and_no_exercises():
    assert syllabus.shown(PAGE) == len(["One", "two", "three", "Goals", "code"])


def test_the_main_path_has_at_most_24000_words(site):
    toc = project.from_yaml("_toc.yml")
    path = [toc["root"], *(page["file"] for page in toc["parts"][0]["chapters"])]
    words = {page: syllabus.shown((site / f"{page}.html").read_text("utf-8")) for page in path}
    assert sum(words.values()) <= 24_000, words
