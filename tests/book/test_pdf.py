"""The book on paper: one page of all pages, printed by Chromium."""

from concurrent.futures import ThreadPoolExecutor

import pdf
import pytest
from bs4 import BeautifulSoup
from click.testing import CliRunner

PAGE = """<html><head><link rel="stylesheet" href="../_static/print.css">
<script src="../_static/mathjax.js"></script><script src="../_static/theme.js"></script></head>
<body><nav>Chapters</nav><article><h1 id="top">{0}</h1><button>copy</button>
<details><summary>Solution</summary>It is so.</details>
<a href="two.html#top">there</a> <a href="#top">here</a> <a href="two.ipynb">notebook</a>
</article></body></html>"""


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A site of two pages, and one of the library."""
    (tmp_path / "book").mkdir()
    (tmp_path / "index.html").touch()
    for name in ("one", "two", "api_control"):
        (tmp_path / f"book/{name}.html").write_text(PAGE.format(name))
    monkeypatch.setattr(pdf, "pages", lambda: ["book/one", "book/two", "book/api_control"])
    return tmp_path


def test_all_pages_become_one_for_paper_whose_links_lead_within_it(site):
    page = BeautifulSoup(pdf.joined(site), "html.parser")
    assert [one.get_text() for one in page.select("h1")] == ["one", "two"]
    targets = [link["href"] for link in page.select("a")]
    assert targets == ["#two--top", "#one--top", "two.ipynb", "#two--top", "#two--top", "two.ipynb"]
    assert all(page.find(id=one[1:]) for one in targets if one.startswith("#"))
    assert page.title.get_text() == "Reinforcement learning on NMPC, reproduced"
    assert all(one.has_attr("open") for one in page.select("details"))
    assert not page.select("button, nav")
    assert [one["src"] for one in page.select("script")] == ["../_static/mathjax.js"]


@pytest.mark.browser
def test_it_is_printed_and_leaves_no_page_behind(site, monkeypatch):
    monkeypatch.setattr(pdf, "READY", "() => {}")
    with ThreadPoolExecutor(1) as apart:  # from the browser of the session's other tests
        result = apart.submit(CliRunner().invoke, pdf.main, [str(site)]).result()
    assert result.exit_code == 0, result.output
    assert (site / "nmpcrl.pdf").read_bytes().startswith(b"%PDF")
    assert not (site / "book/whole.html").exists()


def test_without_a_built_book_or_a_chromium_a_sentence_says_what_to_do(site, tmp_path, monkeypatch):
    assert "`make book`" in CliRunner().invoke(pdf.main, [str(tmp_path / "none")]).output
    monkeypatch.setenv("PATH", "")
    assert "apt-get install chromium" in CliRunner().invoke(pdf.main, [str(site)]).output
