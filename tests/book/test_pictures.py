"""A figure's page has files of it for every screen, and an alternative text with its finding."""

import re
from base64 import b64encode
from pathlib import Path

import pytest
from driver.page import pictures
from markdown_it import MarkdownIt
from nbformat.v4 import new_code_cell, new_notebook, new_output

from nmpcrl.report.figures.sheet import MIME

PNG, SVG = b"\x89PNG", "<svg/>"


def notebook(wide: dict, narrow: dict | None) -> object:
    """A notebook with one figure, as a build executes it."""
    shown = {"finding": 'It is "so" < 1', "wide": {"width": 672, "height": 300, **wide}}
    if narrow is not None:
        shown["narrow"] = {"width": 346, "height": 500, **narrow}
    data = {"image/png": b64encode(PNG).decode(), MIME: shown}
    settings = {"image": {"alt": "Two lines."}, "figure": {"name": "fig-es-theta", "caption": "C"}}
    cell = new_code_cell(
        "draw()", metadata={"mystnb": settings}, outputs=[new_output("display_data", data)]
    )
    return new_notebook(cells=[new_code_cell("1", outputs=[]), cell])


def html(one: object) -> str:
    return one.cells[1].outputs[0].data["text/html"]


def test_a_figure_becomes_a_picture_with_its_files():
    one = notebook({"svg": SVG}, {"svg": SVG})
    assert pictures.placed(one) == {
        "es-theta.png": PNG,
        "es-theta.svg": SVG.encode(),
        "es-theta-narrow.svg": SVG.encode(),
    }
    assert 'srcset="../_static/figures/es-theta-narrow.svg" width="346" height="500"' in html(one)
    assert '<img src="../_static/figures/es-theta.png"' in html(one)
    assert 'width="672" height="300"' in html(one)
    assert MIME not in one.cells[1].outputs[0].data


def test_the_link_of_a_figure_that_plays_plays_it_if_it_is_an_svg():
    for files, link in (({"svg": SVG}, ".svg#play"), ({}, ".png")):
        one = notebook(files, {"svg": SVG})
        one.cells[1].outputs[0].data[MIME]["plays"] = True
        pictures.placed(one)
        assert f'<a href="../_static/figures/es-theta{link}">' in html(one)
        assert "#play" not in html(one).split("</a>")[0].split(">", 1)[1]


def test_what_has_no_light_svg_is_shown_as_a_png():
    one = notebook({}, {"png": b64encode(PNG).decode()})
    assert pictures.placed(one) == {"es-theta.png": PNG, "es-theta-narrow.png": PNG}
    assert ".svg" not in html(one)
    assert html(one).count('"../_static/figures/es-theta.png"') == 3


@pytest.mark.parametrize("kind", ["svg", "heavy"])
def test_a_teacher_gets_each_figure_as_svg_and_pdf_however_heavy_it_is(kind):
    one = notebook({kind: SVG}, None)
    shown = one.cells[1].outputs[0].data[MIME]
    with pytest.raises(KeyError):  # of an older build
        pictures.vectors(one)
    shown["pdf"] = b64encode(b"%PDF").decode()
    name = one.cells[1].id
    assert pictures.vectors(one) == {f"{name}.svg": SVG.encode(), f"{name}.pdf": b"%PDF"}


def test_the_alternative_text_is_the_finding_and_then_the_form():
    one = notebook({"svg": SVG}, {"svg": SVG})
    pictures.placed(one)
    assert 'alt="It is &quot;so&quot; &lt; 1. Two lines."' in html(one)


@pytest.mark.parametrize(
    ("finding", "expected"),
    [("It falls", "It falls. A line."), ("Does it?", "Does it? A line."), ("", "A line.")],
)
def test_a_finding_ends_as_a_sentence(finding, expected):
    assert pictures.alternative(finding, "A line.") == expected


def test_a_figure_that_has_one_size_stays_an_image():
    one = notebook({"svg": SVG}, None)
    assert pictures.placed(one) == {}
    assert set(one.cells[1].outputs[0].data) == {"image/png"}


def test_a_notebook_to_take_away_has_what_editors_show():
    one = pictures.plain(notebook({"svg": SVG}, {"svg": SVG}))
    assert set(one.cells[1].outputs[0].data) == {"image/png"}


BOOK = Path(__file__).resolve().parents[2] / "book"
INTRO = (BOOK / "intro.md").read_text()


def test_the_introductions_picture_has_a_narrow_version_with_the_same_finding_for_telephones():
    shown = pictures.beside(INTRO, BOOK)
    assert '<p><a href="../_static' not in MarkdownIt().render(shown)  # which tears it apart
    (narrow,) = re.findall(rf'media="{re.escape(pictures.NARROW)}" srcset="../([^"]+)"', shown)
    (wide,) = re.findall(r'<img src="../([^"]+)" alt="Short plans make', shown)
    for picture in (wide, narrow):
        words = re.findall("<!-- (.*) -->", (BOOK / picture).read_text())
        assert "Plans of at most 1.2 m make a trajectory of 11.4 m" in " ".join(words)
    assert 'width="672" height="355"' in shown
    (width,) = re.findall(r'width="(\d+)" height="\d+">\n<source srcset', shown)
    assert int(width) <= 390


def test_an_image_without_a_narrow_version_stays(tmp_path):
    assert pictures.beside(INTRO, tmp_path) == INTRO
