"""What is repaired in a page's HTML so that it can be heard and worked without a mouse."""

import pytest
from bs4 import BeautifulSoup
from driver.page import accessible

PANDAS = """<article><table class="dataframe">
<thead><tr><th></th><th>cost</th></tr><tr><th>layout</th><th></th></tr></thead>
<tbody><tr><th>A</th><td>1.0</td></tr></tbody></table></article>"""
SOLUTION = """<article><div class="solution dropdown admonition" id="book/04-solution-1">
<p class="admonition-title">Solution</p><section id="solution-content"><p>Six.</p></section>
</div></article>"""


def repaired(html: str) -> BeautifulSoup:
    return BeautifulSoup(accessible.page(html), "html.parser")


def test_a_header_cell_that_heads_nothing_is_an_ordinary_cell():
    rows = [[cell.name for cell in row.find_all(["th", "td"])] for row in repaired(PANDAS)("tr")]
    assert rows == [["td", "th"], ["th", "td"], ["th", "td"]]


def test_a_header_cell_says_whether_it_heads_a_column_or_a_row():
    scopes = {cell.get_text(): cell["scope"] for cell in repaired(PANDAS)("th")}
    assert scopes == {"cost": "col", "layout": "col", "A": "row"}


def test_a_header_cell_that_holds_a_picture_stays_one():
    (cell,) = repaired('<article><table><tr><th><img alt="A"></th></tr></table></article>')("th")
    assert cell["scope"] == "row"


def test_a_table_is_put_into_a_box_that_scrolls_in_its_place():
    (table,) = repaired(PANDAS)("table")
    assert table.parent["class"] == ["scrolls"]
    assert table.parent.parent.name == "article"


def test_a_table_of_the_theme_stays_as_it_is():
    assert repaired("<nav><table></table></nav>").select(".scrolls") == []


def test_a_box_that_a_script_folds_becomes_one_that_its_title_opens():
    (box,) = repaired(SOLUTION)("details")
    assert box["id"] == "book/04-solution-1"
    assert box["class"] == ["solution", "admonition", "folded"]
    assert not box.has_attr("open")
    assert [part.name for part in box.find_all(True, recursive=False)] == ["summary", "section"]
    assert box.summary.get_text() == "Solution"
    assert box.section.get_text() == "Six."


def test_a_box_that_is_not_folded_stays_open():
    html = (
        '<article><div class="admonition tip"><p class="admonition-title">Goals</p></div></article>'
    )
    assert accessible.page(html) == html


def test_ids_that_every_exercise_repeats_go():
    assert repaired(SOLUTION).select("#solution-content") == []


def test_a_summary_is_called_what_it_reads():
    html = '<details><summary aria-label="Toggle hidden content">Show the code</summary></details>'
    assert not repaired(html).summary.has_attr("aria-label")


def test_a_bibliography_is_a_list_of_items():
    html = '<div role="list"><div class="citation" role="doc-biblioentry">Gros</div></div>'
    assert repaired(html).select_one(".citation")["role"] == "listitem"


def test_the_side_bar_is_a_landmark_with_a_name():
    bar = repaired('<div id="pst-primary-sidebar"></div>').div
    assert (bar["role"], bar["aria-label"]) == ("navigation", "Book")


@pytest.mark.parametrize("html", [PANDAS, SOLUTION])
def test_a_page_that_is_repaired_stays_as_it_is(html):
    once = accessible.page(html)
    assert accessible.page(once) == once


def test_words_code_and_scripts_keep_every_character():
    html = (
        "<!DOCTYPE html>\n<html><head><script>if (1 < 2 && true) {}</script></head>"
        '<body id="b" class="a"><pre>a &lt; b &amp; c\n    d</pre>'
        "<p>\\(x &lt; y\\)\u00a0–</p></body></html>"
    )
    assert accessible.page(html) == html


def test_every_page_of_a_folder_is_repaired_but_those_of_the_theme(tmp_path):
    own, theme = tmp_path / "book/a.html", tmp_path / "_static/b.html"
    for path in (own, theme):
        path.parent.mkdir()
        path.write_text(SOLUTION)
    accessible.site(tmp_path)
    assert own.read_text() == accessible.page(SOLUTION)
    assert theme.read_text() == SOLUTION


def test_the_parameters_of_a_long_signature_are_no_list_without_terms():
    html = '<article><dl><dt class="sig">f(<dl><dd>x</dd><dd>y</dd></dl>)</dt><dd>It.</dd></dl>'
    soup = repaired(html)
    assert [one.get_text() for one in soup.select("dt div.parameters > div.parameter")] == [
        "x",
        "y",
    ]
    assert [one.get_text() for one in soup("dd")] == ["It."]
