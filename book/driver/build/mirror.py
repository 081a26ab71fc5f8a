"""The sources of the book in the place of a build, where they may be changed."""

import shutil
from importlib.resources import as_file, files
from pathlib import Path

import yaml

from driver.project import ROOT, from_yaml

BUTTONS = ("use_repository_button", "use_edit_page_button", "use_issues_button")


def mirror(place: Path, announcement: str) -> Path:
    """Copy the sources to PLACE/src, where chapters may be replaced by their executed selves."""
    source = place / "src"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(
        ROOT / "book", source / "book", ignore=shutil.ignore_patterns("__pycache__", ".*")
    )
    shutil.copy2(ROOT / "_toc.yml", source)
    (source / "nmpcrl").symlink_to(ROOT / "nmpcrl")  # for literalinclude
    config = from_yaml("_config.yml")
    config["html"]["announcement"] = announcement
    if config["repository"]["url"]:
        config["html"] |= dict.fromkeys(BUTTONS, True)
    (source / "_config.yml").write_text(yaml.safe_dump(config, allow_unicode=True))
    with as_file(files("sphinx-mathjax-offline") / "static/mathjax/tex-svg-full.js") as script:
        target = source / "book/_static/mathjax"
        target.mkdir()
        shutil.copy2(script, target)
    return source
