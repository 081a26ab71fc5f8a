"""The pages of the built book as one HTML document, from which `pdf` prints the book.

Pages in, a document out: the articles in the order of _toc.yml, but for the library's API, behind a
title page and a table of contents. Every identifier gets the name of its page, so links between
pages become links within the document; what is only for a screen goes; what is folded opens;
headings go down by a level within a part; a formula gets words for whoever hears it.
"""

import os
import posixpath
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag, urlsplit

from bs4 import BeautifulSoup, Tag

from driver.project import from_yaml, listed

Element = Any  # Beautiful Soup's, a dictionary of attributes among other things

DOCUMENT = """<!DOCTYPE html>
<html lang="en" data-theme="light" data-mode="light">
<head>
<meta charset="utf-8">
<title>{title}</title>
{loaded}
<style>
{margins}
</style>
</head>
<body class="whole-book">
{cover}
{contents}
{pages}
</body>
</html>
"""
COVER = """<section class="cover">
<p class="cover-title">{title}</p>
<p>{author}</p>
<p>{cited}</p>
<p class="cover-warning">{warning}</p>
<p class="cover-picture"><img src="{picture}" alt="{alt}"></p>
<p>{version}</p>
<p>{made}</p>
<p>{licence}</p>
</section>"""
MADE = """Every number, table and figure in this book comes from code that <code>make book</code>
ran; <code>make pdf</code> then printed the pages of the HTML book, with all solutions and all code
shown. The reference of the library is in the HTML book alone."""
LICENCE = """The text and the figures are under the Creative Commons Attribution 4.0 International
licence (CC BY 4.0), the code is under the MIT licence."""
CITED = """A literate reproduction of {authors}, <cite>{title}</cite>, {number}."""
ALT = "The robot's trajectory around four obstacles, and some of the short plans behind it."

API = re.compile(r"book/api(_\w+)?")  # pages to search on a screen, and not to read
SCREEN = (  # nothing for paper
    "script, style, link, button, iframe, form, figure.live, div.answer, .headerlink, .download"
)
COLOURLESS = ".highlight .n, .highlight .p, .highlight .w"  # half of all elements, each with a tag
REFERRING = ("for", "headers", "aria-labelledby", "aria-describedby", "aria-controls")

WORDS = "data-words"  # the attribute with the words of a formula
FORMULA = "Formula: "  # how they begin
FONTS = "boldsymbol|mathbf|mathbb|mathcal|mathrm|text|operatorname"
LOOKS = r"\\(?:left|right|[bB]igg?[lr]?|q?quad|textstyle)(?![a-zA-Z])|\\[,;:! ]|[&~]"
SIGNS = {"leftarrow": " ← ", "to": " → ", "le": " ≤ ", "ge": " ≥ ", "in": " ∈ ", "approx": " ≈ "}
SIGNS |= {"cdot": " · ", "times": " × ", "dots": "…", "lVert": "‖", "rVert": "‖", "top": "T"}


@dataclass(frozen=True)
class Page:
    """A page of the site."""

    name: str  # its path in the site, without suffix
    part: str  # the caption of the part that begins with it
    level: int  # of its title, among the headings of the document
    article: Element
    warning: str  # of a build that is not the book

    @property
    def title(self) -> Element:
        """Its heading, with the number of a chapter."""
        return self.article.find(re.compile("^h[1-6]$"))

    @property
    def sections(self) -> list[tuple[str, Element]]:
        """Identifier and heading of each."""
        headings = self.article.find_all(f"h{self.level + 1}")
        return [(one.parent["id"], one) for one in headings]


def read(site: Path) -> Iterator[Page]:
    """The pages in the order of _toc.yml, without those of the library's API."""
    toc = from_yaml("_toc.yml")
    yield page(site, toc["root"], "", 1)
    for part in toc["parts"]:
        files = [one["file"] for one in part["chapters"] if not API.fullmatch(one["file"])]
        captions = [part["caption"]] + [""] * len(files)
        for file, caption in zip(files, captions, strict=False):
            yield page(site, file, caption, 2)


def parsed(site: Path, name: str) -> Element:
    return BeautifulSoup((site / f"{name}.html").read_text("utf-8"), "html.parser")


def page(site: Path, name: str, part: str, level: int) -> Page:
    soup = parsed(site, name)
    banner = soup.select_one(".bd-header-announcement")
    return Page(name, part, level, soup.article, plain(banner) if banner else "")


def plain(element: Element) -> str:
    """The words of an element, and of its formulas what they say."""
    words = (spoken(text) if text.find_parent(class_="math") else text for text in element.strings)
    return " ".join("".join(words).split())


def identifier(page: str, fragment: str = "") -> str:
    """What a page, or an element of it, is called in the document."""
    return "--".join(filter(None, (page.replace("/", "-"), fragment)))


def address(href: str, page: str, names: Collection[str]) -> str:
    """Where a link of a page leads from the document; nowhere, if to a file that is not in it."""
    if urlsplit(href).scheme:
        return href
    path, fragment = urldefrag(href)
    target = posixpath.normpath(posixpath.join(posixpath.dirname(page), unquote(path)))
    name = target.removesuffix(".html") if path else page
    return f"#{identifier(name, unquote(fragment))}" if name in names else ""


def document(site: Path, target: Path, version: str) -> str:
    """The book as one document, whose place will be `target`."""
    pages = list(read(site))
    names = [page.name for page in pages]
    config = from_yaml("_config.yml")
    for one in pages:
        adapt(one, site, target, names)
    return DOCUMENT.format(
        title=escape(config["title"]),
        loaded=loaded(site, names[0], target),
        margins="\n".join(margins(config["title"], pages)),
        cover=cover(config, version, pages[0].warning, os.path.relpath(site, target.parent)),
        contents=table_of_contents(pages),
        pages="\n".join(map(section, pages)),
    )


def loaded(site: Path, name: str, target: Path) -> str:
    """The style sheets of a page, and MathJax with its settings, as the document loads them."""
    kept = []
    for element in parsed(site, name).head.select("link[rel=stylesheet], script"):
        attribute = "href" if element.name == "link" else "src"
        if element.name == "script" and "mathjax" not in str(element).lower():
            continue
        if path := urldefrag(element.get(attribute, ""))[0]:
            file = (site / name).parent / urlsplit(path).path
            element[attribute] = os.path.relpath(file, target.parent)
        kept.append(str(element))
    return "\n".join(kept)


def margins(title: str, pages: list[Page]) -> Iterator[str]:
    """Each page of the site is a named page of the document, with its title in the margin."""
    yield f":root {{ --book: {quoted(title)}; }}"
    for one in pages:
        name, words = identifier(one.name), plain(one.title)
        shown = quoted(words) if words != title else "none"
        yield f"@page {name} {{ @top-right {{ content: {shown}; }} }}"
        yield f"#{name} {{ page: {name}; }}"


def quoted(text: str) -> str:
    """A string of CSS."""
    return '"' + re.sub(r'(["\\<])', lambda found: f"\\{ord(found[1]):x} ", text) + '"'


def cover(config: dict[str, str], version: str, warning: str, site: str) -> str:
    (paper,) = from_yaml("CITATION.cff")["references"]
    names = listed(f"{one['given-names']} {one['family-names']}" for one in paper["authors"])
    number = f'<a href="{paper["url"]}">{paper["identifiers"][0]["value"]}</a>'
    return COVER.format(
        title=escape(config["title"]),
        cited=CITED.format(authors=escape(names), title=escape(paper["title"]), number=number),
        author=escape(config["author"]),
        warning=escape(warning),
        picture=f"{site}/_static/closed_loop.svg",
        alt=escape(ALT),
        version=escape(version),
        made=MADE,
        licence=LICENCE,
    )


def table_of_contents(pages: list[Page]) -> str:
    """Parts, chapters and sections, each a link with room for a number."""
    lines = ['<nav class="all-pages">', '<h1 id="contents">Contents</h1>', "<ul>"]
    for one in pages:
        if one.part:
            lines.append(f'</ul>\n<p class="part">{escape(one.part)}</p>\n<ul>')
        inner = "".join(f"<li>{entry(*each)}</li>" for each in one.sections)
        lines.append(f"<li>{entry(identifier(one.name), one.title)}<ul>{inner}</ul></li>")
    return "\n".join([*lines, "</ul>", "</nav>"]).replace("<ul></ul>", "")


def entry(target: str, heading: Element) -> str:
    words = "".join(map(str, heading.contents))
    return f'<a href="#{target}"><span>{words}</span><span class="page-number"></span></a>'


def section(one: Page) -> str:
    for name, heading in one.sections:  # a section may begin on the page before its heading
        heading["id"] = name
        del heading.parent["id"]
    part = f'<h1 class="part">{escape(one.part)}</h1>' if one.part else ""
    return f'<section id="{identifier(one.name)}">{part}\n{one.article}\n</section>'


def adapt(one: Page, site: Path, target: Path, names: Collection[str]) -> None:
    """Make an article a part of the document."""
    article = one.article
    for element in article.select(SCREEN):
        element.decompose()
    for details in article.find_all("details"):
        details["open"] = ""
    for token in article.select(COLOURLESS):
        token.unwrap()
    for formula in article.select(".math"):
        voice(formula)
    for picture in article.find_all("picture"):
        choose(picture)
    for image in article.find_all("img"):
        path = (site / one.name).parent / unquote(image["src"])
        image["src"] = os.path.relpath(path, target.parent)
    article.smooth()
    seen: set[str] = set()
    for element in article.find_all(True):
        rename(element, one.name, seen)
    for link in article.find_all("a", href=True):
        link["href"] = address(link["href"], one.name, names)
        if not link["href"]:
            link.unwrap()
    for heading in article.find_all(re.compile("^h[1-6]$")):
        heading.name = f"h{min(int(heading.name[1]) + one.level - 1, 6)}"


def choose(picture: Element) -> None:
    """Of what a browser may choose from, what is for paper: the source for any screen, if any."""
    image = picture.img
    assert image
    for source in picture.find_all("source", media=False):
        image["src"] = source["srcset"]
    picture.replace_with(image)


def rename(element: Element, page: str, seen: set[str]) -> None:
    """Give an element, and what it refers to, the name of its page; the second of a name none."""
    name = element.get("id")
    if name in seen:
        del element["id"]
    elif name:
        seen.add(name)
        element["id"] = identifier(page, name)
    for attribute in REFERRING:
        if names := element.get(attribute):
            each = names.split() if isinstance(names, str) else names
            element[attribute] = " ".join(identifier(page, one) for one in each)


def headings(document: str) -> list[str]:
    """The words of all headings of a document, in their order."""
    found = BeautifulSoup(document, "html.parser").find_all(re.compile("^h[1-6]$"))
    return list(map(plain, found))


def voice(formula: Element) -> None:
    """Put a formula, without its number, into an element that has it in words."""
    for text in formula.find_all(string=True, recursive=False):
        if text.strip():
            text.wrap(Tag(name=formula.name, attrs={WORDS: FORMULA + spoken(text)}))


def spoken(tex: str) -> str:
    """A formula without its looks: `V_theta(s)` for `V_{\\boldsymbol{\\theta}}(\\mathbf{s})`."""
    tex = re.sub(r"^\s*\\[(\[]|\\[)\]]\s*$|\\(begin|end)\{[a-z*]+\}", " ", tex)
    tex = re.sub(rf"\\(?:{FONTS})\s*\{{([^{{}}]*)\}}", r"\1", tex)
    tex = re.sub(rf"\\(?:{FONTS})(?![a-zA-Z])", "", tex).replace(r"\\", ";")
    tex = re.sub(
        r"\\[td]?frac\s*(\{[^{}]*\}|\w)\s*(\{[^{}]*\}|\w)", r"\1/\2", re.sub(LOOKS, " ", tex)
    )
    tex = re.sub(r"\\([a-zA-Z]+)", lambda name: SIGNS.get(name[1], f"\0{name[1]}\0"), tex)
    tex = re.sub(r"(?<=[A-Za-z0-9])\0+(?=[A-Za-z0-9])", " ", tex)  # a space between words only
    tex = re.sub(r"\{\s*(\w|[a-z]+)\s*\}", r"\1", tex.replace("\0", "").replace("\\", ""))
    return re.sub(r" (?=[,.;])", "", " ".join(tex.split()))
