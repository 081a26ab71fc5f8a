"""A text of a notebook as HTML, block by block, for slides."""

import re
from collections.abc import Iterator
from html import escape
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.dollarmath import dollarmath_plugin

ANCHOR = re.compile(r'<a id="[^"]*"></a>\n?')

Piece = tuple[str, str]  # "table", "quote" or "text", and its HTML; "image", its address and words


def _formula(tex: str, options: dict[str, Any]) -> str:
    begin, end = (r"\[", r"\]") if options["display_mode"] else (r"\(", r"\)")
    return f"{begin}{escape(tex)}{end}"


MARKDOWN = MarkdownIt("commonmark").enable("table").use(dollarmath_plugin, renderer=_formula)


def inline(text: str) -> str:
    """A line as HTML; links become words."""
    (token,) = MARKDOWN.parseInline(text)
    return _rendered([token])


def _rendered(tokens: list[Token]) -> str:
    for token in tokens:
        children = [one for one in token.children or [] if not one.type.startswith("link_")]
        token.children = children if token.children else None
    return str(MARKDOWN.renderer.render(tokens, MARKDOWN.options, {})).strip()


def blocks(markdown: str) -> Iterator[Piece]:
    """The blocks of a text."""
    block: list[Token] = []
    for token in MARKDOWN.parse(ANCHOR.sub("", markdown)):
        block.append(token)
        if token.level == 0 and token.nesting <= 0:
            yield _piece(block)
            block = []


def _piece(block: list[Token]) -> Piece:
    kind = block[0].type.removesuffix("_open")
    if kind == "paragraph" and [one.type for one in block[1].children or []] == ["image"]:
        (image,) = block[1].children or []
        return "image", f"{image.attrs['src']} {image.content}"
    if kind == "blockquote":
        return "quote", _rendered(block[1:-1])
    return ("table" if kind == "table" else "text"), _rendered(block)
