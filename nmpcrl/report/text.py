"""Claims, departures and lists as pages write them, in Markdown."""

from collections.abc import Iterable

import pandas as pd

from nmpcrl.claims.paper_claims import CLAIMS, WIDER_THAN
from nmpcrl.claims.robustness import PARTS
from nmpcrl.claims.verdict import Verdict
from nmpcrl.study import design
from nmpcrl.study.departures import DEPARTURES

SURE = 0.01  # of Fisher's test: what chance explains as rarely is called more than chance


def depends_on(verdicts: Iterable[Verdict], judged: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """The departures on which a verdict depends: letter -> claims, both in order."""
    found: dict[str, set[str]] = {letter: set() for letter in DEPARTURES}
    for verdict in verdicts:
        for field, letter in PARTS.items():
            if verdict.depends_on(field):
                found[letter].add(verdict.claim)
    changed = judged[judged.changes.astype(bool)]  # without rows the column has no type of its own
    for variant, claim in changed[["variant", "claim"]].itertuples(index=False):
        letter = design.VARIANTS[variant].departure
        if letter:
            found[letter].add(claim)
    return {letter: tuple(sorted(claims)) for letter, claims in found.items() if claims}


def judged(verdict: Verdict) -> str:
    """A claim, and what became of it, in a sentence of Markdown that links to what it rests on."""
    name = WIDER_THAN.get(verdict.claim, verdict.claim)
    label = name.lower() if name in CLAIMS else "own"
    link = f"[{verdict.claim}](evidence.ipynb#evidence-{label})"
    return f"{link} (*{verdict.statement.rstrip('.')}*): **{verdict.words}**."


def departure_link(words: str, letter: str) -> str:
    """A link to a departure's entry, in Markdown."""
    return f"[{words}](departures.ipynb#departure-{letter})"


def listed(names: Iterable[object]) -> str:
    """ "a, b and c", or "none"."""
    *most, last = [str(name) for name in names] or ["none"]
    return f"{', '.join(most)} and {last}" if most else last
