"""What the driver makes of plain sources, and that it leaves alone what it does not know."""

import pytest
from driver.page import enrich
from hypothesis import given
from hypothesis import strategies as st
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from nmpcrl.control.solvers.riccati import NOTICE


def dressed(*cells) -> list:
    return enrich.notebook(new_notebook(cells=list(cells))).cells


def tagged(source: str, *tags: str):
    return new_markdown_cell(source, metadata={"tags": list(tags)})


def displayed(**data: str):
    """An output that shows something; `text_markdown` for text/markdown."""
    return new_output("display_data", {name.replace("_", "/"): text for name, text in data.items()})


def test_an_equation_with_an_anchor_gets_its_label_and_loses_its_number():
    source = 'so\n\n<a id="eq-a"></a>\n$$\nx = \\text{if } y\n\\tag{1.2}\n$$\n\nand'
    assert enrich.text(source) == ("so\n\n```{math}\n:label: eq-a\nx = \\text{if } y\n```\n\nand")


def test_equations_in_a_row_and_in_a_list_keep_their_own_labels():
    one = '<a id="eq-a"></a>\n$$\na\n\\tag{1.1}\n$$'
    two = '  <a id="eq-b"></a>\n  $$\n  b\n  \\tag{1.2}\n  $$'
    assert enrich.text(f"{one}\n\n- item\n\n{two}") == (
        "```{math}\n:label: eq-a\na\n```\n\n- item\n\n  ```{math}\n  :label: eq-b\n  b\n  ```"
    )


def test_a_formula_without_a_number_stays_as_it_is():
    source = "so\n\n$$\nx = 1\n$$\n\nand $y$"
    assert enrich.text(source) == source


def test_a_heading_with_an_anchor_gets_a_label():
    assert enrich.text('<a id="es-kink"></a>\n## Where') == "(es-kink)=\n## Where"


@pytest.mark.parametrize(
    ("link", "role"),
    [
        ("[Eq. (1.6)](01_mdp.ipynb#eq-ocp)", "{eq}`eq-ocp`"),
        ("[Fig. 1.2](#fig-mdp-plan)", "{numref}`fig-mdp-plan`"),
        ("[Algorithm 2.1](02_es.ipynb#alg-learning)", "{prf:ref}`alg-learning`"),
        ("[Exercise 1.2](#ex-mdp-scale)", "{ref}`ex-mdp-scale`"),
        ("[departure B](departures.ipynb#departure-B)", "{ref}`departure B <departure-B>`"),
        ("[Gros and Zanon (2020)](references.md#gros2019data)", "{cite:t}`gros2019data`"),
        ("[(Gros and Zanon, 2020)](references.md#gros2019data)", "{cite:p}`gros2019data`"),
    ],
)
def test_a_link_to_a_label_becomes_a_reference(link, role):
    assert enrich.text(f"see {link}.") == f"see {role}."


@pytest.mark.parametrize(
    "link", ["[Chapter 1](01_mdp_and_nmpc.ipynb)", "[mpcrl](https://github.com/a/b#readme)"]
)
def test_other_links_stay_as_they_are(link):
    assert enrich.text(link) == link


@given(st.text(alphabet="ab $\\#[]()*_`\n-1", max_size=60))
def test_text_without_anchors_links_and_folds_stays_as_it_is(text):
    assert enrich.text(text) == enrich.LINK.sub(lambda found: enrich.text(found[0]), text)


def test_a_folded_part_becomes_a_box_that_opens():
    source = "<details><summary><code>f</code>: why</summary>\n\nbody\n\n</details>"
    assert enrich.text(source) == ("::::::{admonition} `f`: why\n:class: dropdown\n\nbody\n::::::")


def test_tagged_cells_become_the_boxes_of_the_page():
    cells = dressed(
        tagged("**Learning goals.** After", "goals"),
        tagged("**Try.** A seed", "try"),
        tagged('<a id="ex-a"></a>\n**Exercise 1.1.** How?', "exercise"),
        tagged("<details><summary>Solution</summary>\n\nSo.\n\n</details>", "solution"),
        tagged('<a id="alg-a"></a>\n**Algorithm 1.1.** *Learning*\n\n1. Solve', "algorithm"),
    )
    assert [cell.source for cell in cells] == [
        "::::::{admonition} Learning goals\n:class: tip dropdown\n\nAfter\n::::::",
        "::::::{admonition} Try\n:class: seealso\n\nA seed\n::::::",
        "::::::{exercise}\n:label: ex-a\n\nHow?\n::::::",
        "::::::{solution} ex-a\n:class: dropdown\n\nSo.\n::::::",
        "::::::{prf:algorithm} Learning\n:label: alg-a\n\n1. Solve\n::::::",
    ]


def test_a_caption_moves_to_the_figure_before_it():
    image = {"mystnb": {"image": {"alt": "dots"}}}
    (cell,) = dressed(
        new_code_cell("draw()", metadata=image),
        tagged('<a id="fig-a"></a>\n**Fig. 1.1.** As [Eq. (1.1)](#eq-a) says.', "caption"),
    )
    assert cell.metadata.mystnb == {
        "image": {"alt": "dots"},
        "figure": {"name": "fig-a", "caption": "As {eq}`eq-a` says."},
    }


def test_what_say_displayed_becomes_prose_of_the_page():
    code = 'from nmpcrl.report.prose import say\n\nsay("It costs {c} ({f}).", c=1)\nsay("So.")'
    outputs = [
        displayed(text_markdown="It costs 1 ([Fig. 1.1](#fig-a))."),
        displayed(text_markdown="So."),
    ]
    (cell,) = dressed(new_code_cell(code, outputs=outputs))
    assert (cell.cell_type, cell.source) == ("markdown", "It costs 1 ({numref}`fig-a`).\n\nSo.")


def test_a_cell_that_was_not_executed_stays_code():
    (cell,) = dressed(new_code_cell('say("So.")'))
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
    assert enrich.calls_prose(code) == expected


def test_markdown_that_another_cell_displays_has_its_references_too():
    markdown = displayed(text_markdown="in [B](departures.ipynb#departure-B)")
    (cell,) = dressed(new_code_cell("table()", outputs=[markdown]))
    assert cell.outputs[0].data["text/markdown"] == "in {ref}`B <departure-B>`"


def test_a_page_takes_what_a_cell_of_a_notebook_displayed():
    cell = new_code_cell("table()", metadata={"tags": ["verdicts"]})
    link = '<a href="for_reviewers.{}#reviewers-c1">'
    cell.outputs = [displayed(text_html=f"<table>{link.format('ipynb')}</table>")]
    book = new_notebook(cells=[new_code_cell("x"), cell])

    def output(page: str, tag: str) -> str:
        assert page == "05_results.ipynb"
        return enrich.output(book, tag)

    page = enrich.page("<!-- output: 05_results.ipynb verdicts -->\n", output)
    assert f"<table>{link.format('html')}</table>" in page
    cell.outputs = []
    assert enrich.page("<!-- output: 05_results.ipynb verdicts -->\n", output) == "\n"


def test_the_list_of_references_is_left_to_the_bibliography():
    page = 'Everything.\n\n- <a id="a"></a>A. 2020.\n- <a id="b"></a>B. 2021.\n'
    assert enrich.page(page, lambda *_: "") == "Everything.\n\n```{bibliography}\n```\n"


def test_a_downloaded_notebook_hides_the_calls_and_keeps_what_they_displayed():
    prose = new_code_cell('say("So.")', outputs=[displayed(text_markdown="So.")])
    code = new_code_cell("x = 1", metadata={"papermill": {"duration": 1.0}})
    first, second = enrich.download(new_notebook(cells=[prose, code])).cells
    assert first.metadata == {"jupyter": {"source_hidden": True}}
    assert first.outputs[0].data["text/markdown"] == "So."
    assert second.metadata == {}


def test_a_page_that_was_executed_offers_its_file_below_the_title():
    book = new_notebook(cells=[new_markdown_cell("# One"), new_markdown_cell("Two")])
    title, link, _ = enrich.notebook(book, "one.ipynb").cells
    assert title.source == "# One"
    assert 'href="one.ipynb" download' in link.source


def streams(*texts: str) -> list:
    return [new_output("stream", name="stderr", text=text) for text in texts]


@pytest.mark.parametrize(
    ("said", "left"),
    [
        ((f"{NOTICE} ", "done in 41 s.\n"), []),
        ((f"{NOTICE} done in 0 s.\n", f"{NOTICE} done in 7 s.\n"), []),
        (("A warning.\n", f"{NOTICE} ", "done in 41 s.\n"), ["A warning.\n"]),
        (("A warning.\n",), ["A warning.\n"]),
        ((f"{NOTICE} stopped.\n",), [f"{NOTICE} stopped.\n"]),
    ],
)
def test_what_a_first_solve_says_stands_on_no_page_and_all_else_does(said, left):
    shown = displayed(text_plain="1.0")
    executed = new_notebook(cells=[new_code_cell("solve()", outputs=[*streams(*said), shown])])
    outputs = enrich.without_notices(executed).cells[0].outputs
    assert [one.text for one in outputs if one.output_type == "stream"] == left
    assert outputs[-1] == shown


def test_a_page_begins_with_what_was_found_and_has_one_set_up():
    shown = displayed(text_markdown="1. It moves.")
    cells = dressed(
        new_markdown_cell("# Title"),
        tagged("**Learning goals.** After", "goals"),
        new_code_cell("layout = 'A'", metadata={"tags": ["parameters"]}),
        new_code_cell("import numpy"),
        new_code_cell("1", outputs=[displayed(text_plain="1")]),
        tagged("## What we saw\n", "opening"),
        new_code_cell('say("1. It moves.")', outputs=[shown], metadata={"tags": ["opening"]}),
        new_markdown_cell("## Exercises"),
    )
    title, box, goals, set_up, shows, exercises = [cell.source for cell in cells]
    assert (title, shows, exercises) == ("# Title", "1", "## Exercises")
    assert box == "::::::{admonition} In short\n:class: note\n\n1. It moves.\n::::::"
    assert "Learning goals" in goals
    assert set_up == "layout = 'A'\n\nimport numpy"
    assert "hide-input" in cells[3].metadata["tags"]


def test_the_first_figure_follows_what_was_found_without_its_code():
    def first(*outputs):
        tags = {"tags": ["hide-input", "first-figure"]}
        return dressed(
            new_markdown_cell("# Title"),
            new_code_cell("layout = 'A'", metadata={"tags": ["parameters"]}),
            new_code_cell("figure()", outputs=[*outputs], metadata=dict(tags)),
            tagged('<a id="fig-one"></a>\n**Fig. 1.1.** One.', "caption"),
            tagged("Drag it.", "first-figure"),
        )

    there = first(displayed(image_png=""))
    assert [cell.source for cell in there] == ["# Title", "figure()", "Drag it.", "layout = 'A'"]
    assert there[1].metadata["tags"] == ["first-figure", "remove-input"]
    assert there[1].metadata["mystnb"]["figure"]["name"] == "fig-one"
    left = [cell.source for cell in first()]  # not executed: nothing stands apart from the set-up
    assert left == ["# Title", "layout = 'A'\n\nfigure()", "Drag it."]


def test_the_opening_of_a_page_that_was_not_executed_stays_where_it_is():
    cells = dressed(
        new_markdown_cell("# Title"),
        new_code_cell('say("1. It moves.")', metadata={"tags": ["opening"]}),
    )
    assert [cell.source for cell in cells] == ["# Title", 'say("1. It moves.")']
