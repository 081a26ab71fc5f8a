"""A shared link to a page shows its title and the robot."""

from struct import unpack

import pytest
from bs4 import BeautifulSoup
from driver.page import card

HEAD = "<html><head><title>Do the claims hold? &amp; why</title></head><body></body></html>"


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Two pages that were built, one of them in a folder."""
    for name in ("genindex.html", "book/05_results.html", "_static/webpack-macros.html"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(HEAD)
    monkeypatch.setattr(card, "drawn", lambda target: 'A "robot"')
    return tmp_path


def facts(path) -> dict[str, str]:
    found = BeautifulSoup(path.read_text(), "html.parser").select("head > meta[property]")
    return {one["property"]: one["content"] for one in found}


def test_every_page_has_its_title_and_names_the_picture_from_where_it_is(site):
    card.site(site)
    shown = facts(site / "book/05_results.html")
    assert shown["og:title"] == "Do the claims hold? & why"
    assert shown["og:image"] == "../_static/card.png"
    assert shown["og:image:alt"] == 'A "robot"'
    assert facts(site / "genindex.html")["og:image"] == "_static/card.png"
    assert facts(site / "_static/webpack-macros.html") == {}


def test_where_the_book_has_an_address_the_picture_has_one_too(site, monkeypatch):
    known = card.from_yaml("_config.yml")
    known["html"]["baseurl"] = "https://nmpcrl.org/book/"
    monkeypatch.setattr(
        card, "from_yaml", lambda name: known if "config" in name else {"abstract": "A"}
    )
    card.site(site)
    assert facts(site / "genindex.html")["og:image"] == "https://nmpcrl.org/book/_static/card.png"


def test_the_picture_is_as_large_as_a_card_and_says_what_it_shows(tmp_path):
    words = card.drawn(tmp_path / "card.png")
    assert "trajectory" in words
    size = unpack(">II", (tmp_path / "card.png").read_bytes()[16:24])
    assert size == card.SIZE
