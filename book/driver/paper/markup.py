"""Sentences of the report, which are Markdown with LaTeX or HTML tables, as Typst reads them."""

import re
from typing import Any

from bs4 import BeautifulSoup
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin

from driver.paper.whole import spoken

READER: Any = MarkdownIt().use(dollarmath_plugin, allow_digits=False)
MARKS = {"strong_open": "#strong[", "em_open": "#emph[", "strong_close": "]", "em_close": "]"}
MARKS |= {"softbreak": " ", "hardbreak": " "}
PARAGRAPH = ("paragraph_open", "paragraph_close")
SPECIAL = re.compile(r"([\\#$*_`<>@\[\]=~+/-])")
OF_THE_BOOK = re.compile(r"(?=^(?:Fig\.|Chapter) \d)")  # an article has figures of its own

FONTS = {"boldsymbol": "bold", "mathbf": "upright(bold", "mathcal": "cal", "mathrm": "upright"}
SIGNS = {
    "varepsilon": "epsilon",
    "epsilon": "epsilon.alt",
    "varphi": "phi",
    "top": "upright(T)",
    "lVert": "norm(",
    "rVert": ")",
    "dots": "dots",
    "le": "<=",
    "ge": ">=",
    "cdot": "dot",
    "times": "times",
    ",": "thin",
    "text": "upright",
}
ALIKE = "alpha beta gamma delta theta omega rho phi pi nu nabla Xi sigma zeta sqrt in"
SIGNS |= {name: name for name in re.findall(r"\w+", ALIKE)}


def text(markdown: str) -> str:
    """Paragraphs of Markdown as markup of Typst; of a link to a page and of HTML the words stay.

    Raises:
        KeyError: they hold what this does not know, of Markdown or of LaTeX.
    """
    inline = (token.children for token in READER.parse(markdown) if token.type not in PARAGRAPH)
    return "\n\n".join(map(_inline, inline))


def rows(table: str) -> list[list[str]]:
    """The cells of a table in HTML, its header first, as markup of Typst."""
    found = BeautifulSoup(table, "html.parser").find_all("tr")
    return [[_cell(cell) for cell in row.find_all(["td", "th"])] for row in found]


def _inline(tokens: list[Any]) -> str:
    """What stands in a paragraph."""
    parts = []
    for before, token in zip([None, *tokens], tokens, strict=False):
        if token.type == "text":
            linked = before is not None and before.type == "link_open"
            parts.append(escaped(_of_the_book(token.content) if linked else token.content))
        elif token.type == "code_inline":
            parts.append(f'#raw("{token.content}")')
        elif token.type == "math_inline":
            parts.append(_formula(token.content))
        elif token.type not in ("html_inline", "link_open", "link_close"):
            parts.append(MARKS[token.type])
    return "".join(parts)


def _formula(tex: str) -> str:
    """A formula, with its words for whoever hears it."""
    return f'#math.equation(alt: "{spoken(tex)}", ${math(tex)}$.body)'


def _of_the_book(words: str) -> str:
    return f"{words} of the book" if OF_THE_BOOK.search(words) else words


def _cell(cell: Any) -> str:
    """What stands in a cell; signs that no text has hold the place of its markup."""
    for mark, name in (("strong", "strong"), ("em", "emph")):
        for one in cell.find_all(mark):
            one.replace_with(f"\0{name}\1{one.get_text()}\2")
    for one in cell.find_all("br"):
        one.replace_with("\3")
    words = escaped(cell.get_text())
    return words.replace("\0", "#").replace("\1", "[").replace("\2", "]").replace("\3", " \\ ")


def escaped(words: str) -> str:
    """Words in which nothing is markup."""
    return SPECIAL.sub(r"\\\1", words)


def math(tex: str) -> str:
    """A formula of the book, in LaTeX, as Typst has it.

    Raises:
        KeyError: a command is not known.
    """
    tex = tex.replace("{,}", ",").replace("\\\\", "\\")
    for name, font in FONTS.items():
        close = ")" * (1 + font.count("("))
        tex = re.sub(rf"\\{name}\{{([^{{}}]*)\}}", rf" {font}(\1{close} ", tex)
    tex = re.sub(r"\\text\{([^{}]*)\}", r' "\1" ', tex)
    tex = re.sub(r"\\([a-zA-Z]+|,)", lambda found: f" {SIGNS[found[1]]} ", tex)
    return " ".join(tex.replace("{", "(").replace("}", ")").split())
