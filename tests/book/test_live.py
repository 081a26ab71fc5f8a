"""What the driver does for live figures: pages share their scripts, and runs are there if asked."""

from pathlib import Path

import nbformat
import pytest
from driver.page import live


def figure_of(style: str, script: str) -> nbformat.NotebookNode:
    """A notebook whose only cell displayed a figure with these files."""
    files = (("style", "live.css", style), ("script", "solver.js", script))
    html = "\n".join('<{0} data-file="{1}">\n{2}\n</{0}>'.format(*file) for file in files)
    shown = [nbformat.v4.new_output("display_data", {"text/html": html})]
    return nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("x", outputs=shown)])


def test_what_is_inline_becomes_a_link_to_a_file_that_pages_share_if_it_is_the_same(tmp_path):
    for _ in range(2):
        notebook = figure_of("p { margin: 0 }", 'run("\\d")')
        live.share(notebook, Path("book/01.ipynb"), tmp_path)
        assert notebook.cells[0].outputs[0].data["text/html"] == (
            '<link rel="stylesheet" href="../_static/live/live.css">\n'
            '<script src="../_static/live/solver.js"></script>'
        )
    assert (tmp_path / "solver.js").read_text() == 'run("\\d")'
    with pytest.raises(ValueError, match=r"another solver\.js than the one"):
        live.share(figure_of("p { margin: 0 }", "c"), Path("book/02.ipynb"), tmp_path)


def test_a_notebook_has_one_seed_in_one_layout_and_asks_for_nothing(browser, site, tmp_path):
    notebook = nbformat.read(site / "book/05_results.ipynb", 4)
    (html,) = [text for text in live.shown(notebook) if live.ASKS in text]
    page, requests = browser.new_page(), []
    page.on("request", lambda request: requests.append(request.url))
    (tmp_path / "output.html").write_text(f"<!DOCTYPE html><meta charset='utf-8'>{html}")
    page.goto((tmp_path / "output.html").as_uri())
    page.locator("figure.live .results b").first.wait_for()
    assert page.get_by_label("Layout").locator("option").all_inner_texts() == ["A"]
    assert page.get_by_label("Seed").locator("option").all_inner_texts() == ["0"]
    assert len(requests) == 1
    page.close()
