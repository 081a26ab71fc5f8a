"""Gaps and contradictions of the paper, and their readings, from `departures.toml`.

Each use in the code carries `# departure X`, which a test checks, and the book renders this table.
The texts are Markdown.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Departure:
    """One gap of the paper and its reading."""

    gap: str  #: in the paper
    reading: str  #: of this library
    why: str  #: evidence or reason
    variant: str = ""  #: fields of `Experiment` for the other reading, if there are any


FILE = Path(__file__).with_suffix(".toml")
DEPARTURES = {
    letter: Departure(**{name: " ".join(text.split()) for name, text in entry.items()})
    for letter, entry in tomllib.loads(FILE.read_text("utf-8")).items()
}
