"""The sentences of the one-page summary that rest on numbers: Markdown, from what is published."""

from collections.abc import Iterable, Mapping, Sequence

import pandas as pd

from nmpcrl.claims.published import Published
from nmpcrl.claims.rule import UNDECIDABLE, Outcome, Verdict
from nmpcrl.study import design
from nmpcrl.study.departures import DEPARTURES

NOTHING = (
    "Nothing is published in this copy yet; `nmpcrl study --publish` trains the study, judges it"
    " and publishes it."
)
SURE = 0.01  # of Fisher's test: what chance explains as rarely is called more than chance
LAYOUT, DECAY = "B", "C"  # the departures that the main table itself reads in several ways


def compute_effort(found: Published) -> str:
    """What was trained, where, with what, and how long that took."""
    if not found.rows:
        return NOTHING
    about, episodes = found.about, {e.episodes for e in found.rows}
    parts = dict(about["runs"])
    main, controls = parts.pop(design.MAIN_TABLE, 0), parts.pop("controls", 0)
    libraries = listed([f"{name} {version}" for name, version in about["versions"].items()])
    machine = about["machine"]
    return (
        f"These are {len(found.rows):,} runs of {listed(sorted(episodes))} episodes: {main:,} in"
        f" the main table, {controls:,} with other learners for comparison, and"
        f" {sum(parts.values()):,} in {len(parts)} variants. Their clocks add up to"
        f" {about['hours']:.1f} hours of one core, on a machine with {machine['cores']}"
        f" cores ({machine['processor']}, {machine['system']}), with {libraries}."
    )


def outcomes(verdicts: Sequence[Verdict]) -> str:
    """How many claims had each outcome, and which."""
    if not verdicts:
        return NOTHING
    ordered = sorted(verdicts, key=lambda v: list(Outcome).index(v.outcome))
    counted = []
    for words in dict.fromkeys(v.words for v in ordered):
        names = [v.claim for v in verdicts if v.words == words]
        where = "where " if words.startswith("the ") else ""
        counted.append(f"{len(names)} {where}{words} ({listed(names)})")
    return f"Of {len(verdicts)} claims: {listed(counted)}."


def reversals(verdicts: Iterable[Verdict]) -> str:
    """Where the runs say the reverse of a claim."""
    found = [f"{v.claim}: {' '.join(v.reverse)}" for v in verdicts if v.reverse]
    return " ".join(found) or "Nowhere was the reverse of a claim seen."


def by_layout_and_decay(verdicts: Iterable[Verdict]) -> str:
    """On which claims the layouts, and the readings of the decay, disagree."""
    asked = [v for v in verdicts if v.by_layout]
    layouts = [v.claim for v in asked if disagree(v.by_layout.values())]
    decays = [v.claim for v in asked if disagree(v.by_decay.values())]
    if not asked:
        return ""
    return (
        f"Verdicts that are not the same in every layout: {listed(layouts)}; in both readings of"
        f" the decay: {listed(decays)}."
    )


def verdicts_changed(judged: pd.DataFrame) -> str:
    """How many variants change a verdict; `judged` as `robustness.variant_changes` returns it."""
    variants = judged.variant.unique()
    if not len(variants):
        return ""
    changed = _changed(judged)
    return (
        f"Of {len(variants)} variants, each with one thing changed, {changed.variant.nunique()}"
        f" change at least one verdict, {changed[changed.p < SURE].variant.nunique()} of them by"
        f" more than chance explains (p < {SURE})."
    )


def depends_on(verdicts: Iterable[Verdict], judged: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """The departures on which a verdict depends: letter -> claims, both in order."""
    found: dict[str, set[str]] = {letter: set() for letter in DEPARTURES}
    for verdict in verdicts:
        if disagree(verdict.by_layout.values()):
            found[LAYOUT].add(verdict.claim)
        if disagree(verdict.by_decay.values()):
            found[DECAY].add(verdict.claim)
    for variant, claim in _changed(judged)[["variant", "claim"]].itertuples(index=False):
        letter = design.VARIANTS[variant].departure
        if letter:
            found[letter].add(claim)
    return {letter: tuple(sorted(claims)) for letter, claims in found.items() if claims}


def open_gaps(depends_on: Mapping[str, tuple[str, ...]]) -> str:
    """One item a departure on which a verdict depends: what the paper leaves open, and which."""
    if not depends_on:
        return "Nothing was found on which a verdict depends."
    return "\n".join(
        f"- {DEPARTURES[letter].gap} It matters to {listed(claims)}"
        f" ({departure_link(f'departure {letter}', letter)})."
        for letter, claims in depends_on.items()
    )


def own_claims(verdicts: Iterable[Verdict]) -> str:
    """One item a claim of our own: what it says, and whether that holds."""
    return "\n".join(f"- {v.claim}. {v.statement} *{v.words.capitalize()}.*" for v in verdicts)


def departure_link(words: str, letter: str) -> str:
    """A link to a departure's entry, in Markdown."""
    return f"[{words}](departures.ipynb#departure-{letter})"


def disagree(outcomes: Iterable[str]) -> bool:
    """Whether there are two different ones among those that are decided."""
    return len(set(outcomes) - {UNDECIDABLE}) > 1


def listed(names: Iterable[object]) -> str:
    """ "a, b and c", or "none"."""
    *most, last = [str(name) for name in names] or ["none"]
    return f"{', '.join(most)} and {last}" if most else last


def _changed(judged: pd.DataFrame) -> pd.DataFrame:
    return judged[judged.changes.astype(bool)]  # without rows the column has no type of its own
