"""A text of a notebook as HTML, block by block, for slides."""

import re
from collections.abc import Iterator
from html import escape
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.dollarmath import dollarmath_plugin

ANCHOR = re.compile(r'<a id="[^"]*"></a>\n?')
SENTENCE = re.compile(r".*?[.:!?](?=\s+[A-Z$*`]|$)", flags=re.S)  # the first of a paragraph

Piece = tuple[str, str]  # "title", "lead", "shown" or "said", and its HTML


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
    """The blocks of a text, and the first sentence where one begins with a paragraph."""
    block: list[Token] = []
    leads = True
    for token in MARKDOWN.parse(ANCHOR.sub("", markdown)):
        block.append(token)
        if token.level > 0 or token.nesting > 0:
            continue
        if block[0].type == "heading_open":
            yield "title", _rendered(block[1:-1])
        elif block[0].type == "paragraph_open":
            if leads and (first := SENTENCE.match(block[1].content)):
                yield "lead", f"<p>{inline(first[0])}</p>"
            yield "said", _rendered(block)
        else:
            yield "shown", _rendered(block)
        leads, block = block[0].type == "heading_open", []
