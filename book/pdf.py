"""Print the articles of the built book as one PDF, by the distribution's Chromium: `make pdf`."""

import re
import shutil
from pathlib import Path

import click
from bs4 import BeautifulSoup
from driver.project import ROOT, Failure, from_yaml, pages, shown
from playwright.sync_api import sync_playwright

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SCREEN = "script, style, button, figure.live, div.answer, .headerlink, .download"  # not for paper
LOADED = "meta, link[rel=stylesheet], script:-soup-contains(MathJax), script[src*=mathjax]"
CHAPTERS = "<style>body > div + div { break-before: page; }</style>"
READY = "async () => { await MathJax.startup.promise; await document.fonts.ready; }"


def joined(site: Path) -> str:
    """All pages but those of the library as one; identifiers begin with the names of the pages."""
    paths = {Path(one).name: site / f"{one}.html" for one in pages() if "/api_" not in one}
    soups = {one: BeautifulSoup(path.read_text(), "html.parser") for one, path in paths.items()}
    body = ""
    for name, soup in soups.items():
        for element in soup.article.select(SCREEN):
            element.decompose()
        for element in soup.article.select("[id]"):
            element["id"] = f"{name}--{element['id']}"
        for element in soup.article.select("details"):
            element["open"] = ""
        for link in soup.article.select("a[href]"):
            page, _, label = re.sub(r"\.html\b", "", link["href"], count=1).partition("#")
            if (page or name) in soups:
                link["href"] = f"#{page or name}{f'--{label}' if label else ''}"
        body += f'<div id="{name}">{soup.article}</div>\n'
    title = f"<title>{from_yaml('_config.yml')['title']}</title>"
    loaded = map(str, next(iter(soups.values())).head.select(LOADED))
    head = "\n".join([title, *loaded, CHAPTERS])
    return f'<!DOCTYPE html><html lang="en" data-theme="light"><head>{head}</head><body>{body}'


@click.command()
@click.argument("site", type=click.Path(path_type=Path), default=ROOT / "_build/html")
def main(site: Path) -> None:
    """Print the built book in SITE as one PDF."""
    if not (site / "index.html").exists():
        raise Failure(f"There is no built book in {shown(site)}: `make book` builds it.")
    if (browser := next(filter(None, map(shutil.which, BROWSERS)), None)) is None:
        raise Failure("A Chromium prints the PDF: `apt-get install chromium` installs one.")
    document, pdf = site / "book/whole.html", site / "nmpcrl.pdf"
    document.write_text(joined(site))
    with sync_playwright() as playwright:
        tab = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"]).new_page()
        tab.set_default_timeout(600_000)  # [ms] a busy machine needs many times its load
        tab.goto(document.resolve().as_uri())
        tab.evaluate(READY)
        tab.pdf(path=pdf, format="A4", outline=True, tagged=True, print_background=True)
    document.unlink()
    click.echo(f"{shown(pdf)}: {pdf.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
