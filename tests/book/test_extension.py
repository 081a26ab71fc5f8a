"""What the Sphinx extension repairs: tables for all readers, and equations with a number."""

from driver.page import extension

PANDAS = """<p>so</p><table class="dataframe"><thead><tr><th></th><th>cost</th></tr></thead>
<tbody><tr><th>A</th><td>1.0</td></tr></tbody></table>"""


def body(html: str) -> str:
    context = {"body": html}
    extension.accessible(None, "page", "page.html", context, None)
    return context["body"]


def test_headers_of_a_table_have_a_scope_and_the_table_scrolls():
    html = body(PANDAS)
    assert '<th scope="col">cost</th>' in html
    assert '<th scope="row">A</th>' in html
    assert '<div class="scrolls" tabindex="0"><table' in html


def test_a_header_of_nothing_is_a_cell():
    assert "<tr><td></td>" in body(PANDAS)


def test_a_scope_that_is_there_stays_and_so_does_all_else():
    html = '<table><tr><th scope="colgroup">A</th></tr></table>'
    assert 'scope="colgroup"' in body(html)
    assert body("<p>theory</p>") == "<p>theory</p>"
