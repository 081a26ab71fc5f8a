"""A word of reinforcement learning is defined where it first stands."""

import re
from pathlib import Path

import nbformat
import pytest
from driver.page import enrich

BOOK = Path(__file__).resolve().parents[2] / "book"
FIRST_CHAPTERS = ("01_mdp_and_nmpc", "02_expected_sarsa")
TERMS = ("TD error", "Expected Sarsa", "bootstrap", "semi-gradient", "on-policy", "off-policy")


def read() -> list[str]:
    """The cells of prose in the order of reading, without labels and without the goals."""
    notebooks = [nbformat.read(BOOK / f"{name}.ipynb", 4) for name in FIRST_CHAPTERS]
    return [
        re.sub(enrich.ANCHOR, "", cell.source)
        for notebook in notebooks
        for cell in notebook.cells
        if "goals" not in cell.metadata.get("tags", [])
        and (cell.cell_type == "markdown" or enrich.calls_prose(cell.source))
    ]


@pytest.mark.parametrize("term", TERMS)
def test_a_term_is_defined_in_the_paragraph_that_first_uses_it(term):
    plain = rf"(?<![\w-]){term}(?![\w-])"
    first = next(text for text in read() if re.search(plain, text, flags=re.IGNORECASE))
    paragraph = next(one for one in first.split("\n\n") if re.search(plain, one, re.IGNORECASE))
    assert f"*{term}*" in paragraph
