"""What the driver makes of plain sources, and that it leaves alone what it does not know."""

import pytest
from driver.build.render import download
from driver.page import enrich, extension, prose
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

PANDAS = """<p>so</p><table class="dataframe"><thead><tr><th></th><th>cost</th></tr></thead>
<tbody><tr><th>A</th><td>1.0</td></tr></tbody></table>"""


def dressed(*cells) -> list:
    """The cells of a page, which begins with its title."""
    title, *others = enrich.notebook(new_notebook(cells=[new_markdown_cell("# T"), *cells])).cells
    assert title.source == "# T"
    return others


def tagged(source: str, *tags: str):
    return new_markdown_cell(source, metadata={"tags": list(tags)})


def displayed(**data: str):
    """An output that shows something; `text_markdown` for text/markdown."""
    return new_output("display_data", {name.replace("_", "/"): text for name, text in data.items()})


@pytest.mark.parametrize("block", ["$$\nx\n\\tag{1.2}\n$$", "## Where"])
def test_an_anchor_before_an_equation_or_a_heading_is_a_paragraph_of_its_own(block):
    assert enrich.text(f'so\n\n<a id="a"></a>\n{block}') == f'so\n\n<a id="a"></a>\n\n{block}'
    assert enrich.text('- item\n\n  <a id="a"></a>\n  $$') == '- item\n\n  <a id="a"></a>\n\n  $$'


def test_tagged_cells_become_boxes_and_a_caption_moves_to_the_figure_before_it():
    (cell,) = dressed(tagged('<a id="ex-a"></a>\n**Exercise 1.1.** How?', "exercise"))
    assert cell.source == (
        '<div class="exercise">\n\n<a id="ex-a"></a>\n**Exercise 1.1.** How?\n\n</div>'
    )
    image = {"mystnb": {"image": {"alt": "dots"}}}
    (cell,) = dressed(
        new_code_cell("draw()", metadata=image),
        tagged('<a id="fig-a"></a>\n**Fig. 1.1.** As [Eq. (1.1)](#eq-a) says.', "caption"),
    )
    assert cell.metadata.mystnb == {
        "image": {"alt": "dots"},
        "figure": {"name": "fig-a", "caption": "**Fig. 1.1.** As [Eq. (1.1)](#eq-a) says."},
    }


def test_what_say_displayed_becomes_prose_of_the_page():
    code = 'from nmpcrl.report.prose import say\n\nsay("It costs {c}.", c=1)\nsay("So.")'
    outputs = [displayed(text_markdown="It costs 1."), displayed(text_markdown="So.")]
    (cell,) = dressed(new_code_cell(code, outputs=outputs))
    assert (cell.cell_type, cell.source) == ("markdown", "It costs 1.\n\nSo.")
    (cell,) = dressed(new_code_cell('say("So.")'))  # it was not executed
    assert cell.cell_type == "code"


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ('say("a")', True),
        ("from a import b\n\nsource(b)", True),
        ("import a", False),
        ('x = 1\nsay("a")', False),
        ("print(1)", False),
        ("", False),
    ],
)
def test_a_cell_of_prose_only_imports_and_shows(code, expected):
    assert prose.calls_prose(code) == expected


def test_a_page_takes_and_a_downloaded_notebook_keeps_what_a_cell_displayed():
    cell = new_code_cell("table()", metadata={"tags": ["verdicts"]})
    link = '<a href="evidence.{}#evidence-c1">'
    cell.outputs = [displayed(text_html=f"<table>{link.format('ipynb')}</table>")]
    book = new_notebook(cells=[new_code_cell("x"), cell])
    page = prose.filled(
        "<!-- output: 05_results.ipynb verdicts -->\n",
        lambda page, tag: prose.displayed(book, tag) if page == "05_results.ipynb" else "",
    )
    assert f"<table>{link.format('html')}</table>" in page
    cell.outputs = []
    assert prose.displayed(book, "verdicts") == ""
    words = new_code_cell('say("So.")', outputs=[displayed(text_markdown="So.")])
    code = new_code_cell("x = 1", metadata={"papermill": {"duration": 1.0}})
    first, second = download(new_notebook(cells=[words, code])).cells
    assert first.metadata == {"jupyter": {"source_hidden": True}}
    assert first.outputs[0].data["text/markdown"] == "So."
    assert second.metadata == {}


def test_a_page_begins_with_what_was_found_and_has_one_set_up():
    shown = displayed(text_markdown="1. It moves.")
    box, figure, goals, set_up, shows, exercises = dressed(
        tagged("**Learning goals.** After", "goals"),
        new_code_cell("layout = 'A'", metadata={"tags": ["parameters"]}),
        new_code_cell("import numpy"),
        new_code_cell(
            "draw()",
            outputs=[displayed(image_png="")],
            metadata={"tags": ["hide-input", "first-figure"]},
        ),
        new_code_cell("1", outputs=[displayed(text_plain="1")]),
        tagged("## What we saw\n", "opening"),
        new_code_cell('say("1. It moves.")', outputs=[shown], metadata={"tags": ["opening"]}),
        new_markdown_cell("## Exercises"),
    )
    assert box.source.startswith('<div class="opening">\n\n**In short.**')
    assert box.source.endswith("1. It moves.\n\n</div>")
    assert "What we saw" not in box.source
    assert (figure.source, shows.source, exercises.source) == ("draw()", "1", "## Exercises")
    assert figure.metadata["tags"] == ["remove-input", "first-figure"]
    assert "**Learning goals.**" in goals.source
    assert set_up.source == "layout = 'A'\n\nimport numpy"
    assert "hide-input" in set_up.metadata["tags"]


def test_tables_have_headers_with_a_scope_and_scroll_and_all_else_stays():
    def body(html: str) -> str:
        context = {"body": html}
        extension.accessible(None, "page", "page.html", context, None)
        return context["body"]

    html = body(PANDAS)
    assert '<th scope="col">cost</th>' in html
    assert '<th scope="row">A</th>' in html
    assert '<div class="scrolls" tabindex="0"><table' in html
    assert "<tr><td></td>" in html  # a header of nothing is a cell
    assert 'scope="colgroup"' in body('<table><tr><th scope="colgroup">A</th></tr></table>')
    assert body("<p>theory</p>") == "<p>theory</p>"
