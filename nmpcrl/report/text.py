"""The sentences of the one-page summary that rest on numbers: Markdown, from what is published."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from nmpcrl.claims import prespecified
from nmpcrl.claims.paper_claims import BY_RUNS, CLAIMS, WIDER_THAN, kept_without_noise
from nmpcrl.claims.published import Published
from nmpcrl.claims.reproduce import Agreement
from nmpcrl.claims.robustness import PARTS
from nmpcrl.claims.verdict import PARTLY, REPRODUCED, UNDECIDABLE, Outcome, Verdict
from nmpcrl.study import design
from nmpcrl.study.departures import DEPARTURES

NOTHING = (
    "Nothing is published in this copy yet; `nmpcrl study --publish` trains the study, judges it"
    " and publishes it."
)
WORDS = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
SHOWN = 10  # letters of a commit's hash
SURE = 0.01  # of Fisher's test: what chance explains as rarely is called more than chance


def compute_effort(found: Published) -> str:
    """What was trained, where, with what, and how long that took."""
    if not found.rows:
        return NOTHING
    episodes = {e.episodes for e in found.rows}
    parts = dict(found.parts)
    main, controls = parts.pop(design.MAIN_TABLE, 0), parts.pop("controls", 0)
    return (
        f"These are {len(found.rows):,} runs of {listed(sorted(episodes))} episodes: {main:,} in"
        f" the main table, {controls:,} with other learners for comparison, and"
        f" {sum(parts.values()):,} in {len(parts)} variants. Their clocks add up to"
        f" {listed(map(_made, found.batches))}."
    )


def _made(about: Mapping[str, Any]) -> str:
    """How long some runs took, on which machine, and with what."""
    libraries = listed([f"{name} {version}" for name, version in about["versions"].items()])
    machine = about["machine"]
    return (
        f"{about['hours']:.1f} hours of one core on a machine with {machine['cores']} cores"
        f" ({machine['processor']}, {machine['system']}; {libraries})"
    )


def answer(verdicts: Sequence[Verdict]) -> str:
    """Whether the paper reproduces, in a sentence: how many claims had each outcome, and which."""
    if not verdicts:
        return NOTHING
    verdicts = [v for v in verdicts if v.claim in CLAIMS]
    decided = {v.outcome for v in verdicts} - {UNDECIDABLE}
    head = "in part" if decided & {REPRODUCED, PARTLY} else "no" if decided else "not decidable"
    if decided == {REPRODUCED}:
        head = "yes"
    counted = [_counted(group) for group in _by_words(verdicts)]
    return f"Does it reproduce? **{head.capitalize()}:** of {_all(verdicts)}, {listed(counted)}."


def _by_words(verdicts: Sequence[Verdict]) -> list[list[Verdict]]:
    """The verdicts that a page words alike, together, in the order of the outcomes."""
    ordered = sorted(verdicts, key=lambda v: (bool(v.said), list(Outcome).index(v.outcome)))
    words = dict.fromkeys(v.words for v in ordered)
    return [[v for v in verdicts if v.words == one] for one in words]


def _counted(group: Sequence[Verdict]) -> str:
    words, count = group[0].words, number(len(group))
    names = listed(v.claim for v in group)
    if words.startswith("the "):
        return f"for {count} {words} ({names})"
    return f"{count} {'is' if len(group) == 1 else 'are'} {words} ({names})"


def _all(verdicts: Sequence[Verdict]) -> str:
    implied = sum(CLAIMS[v.claim].implied for v in verdicts)
    made = len(verdicts) - implied
    parts = [f"the paper's {number(made)} claim{'s' if made > 1 else ''}"] * bool(made)
    parts += [f"{number(implied)} that it takes for granted"] * bool(implied)
    return listed(parts)


def number(count: int) -> str:
    """A small number as a word."""
    return WORDS[count] if count < len(WORDS) else f"{count:,}"


def legend(verdicts: Iterable[Verdict], runs: pd.DataFrame) -> str:
    """What the numbers of a table of verdicts mean; `runs` are those that were judged."""
    asked_twice = ""
    if any(v.claim == "C7" and v.by_learner for v in verdicts):
        asked = kept_without_noise(runs, BY_RUNS["C7"].learners)
        stopped = (asked.kept & asked.stopped).sum()
        asked_twice = (
            " C7 has two questions: its percentage counts the runs that kept every constraint in"
            f" training, too. Without noise, {asked.kept.sum()} of {len(asked)} runs kept them,"
            f" {stopped} of which had to be stopped in training."
        )
    return (
        "A percentage is the share of runs, or of pairs of runs, in which the claim held. The"
        " interval of 95 % beside it is for other seeds in these layouts (Wilson's), and *layouts"
        " anew* is the one for other layouts drawn like them (a bootstrap that draws the layouts;"
        " six are few, so it is rather too narrow). Where a claim is about time, the number is the"
        " ratio of the times of a step, with its interval of 95 %. A claim without a number rests"
        f" on no sample.{asked_twice}"
    )


def fixed(found: Mapping[str, Mapping[str, str]]) -> str:
    """In which commit the thresholds were fixed, and how to check it."""
    if not found:
        return (
            "In which commit the thresholds were fixed cannot be said here: they are not those of"
            " the published study, or nothing is published."
        )
    (first, date), (then, later) = (
        (found[name]["hash"][:SHOWN], found[name]["date"]) for name in ("thresholds", "published")
    )
    return (
        f"The thresholds and the rule were fixed in commit `{first}` ({date}"
        f" UTC), and none of their numbers has changed since; [what they are applied"
        f" to](reproducibility.ipynb#reproducibility-since) has. The runs of the study were"
        f" published after it, in commit `{then}` ({later} UTC). In the"
        f" repository, `git show {first}` shows the thresholds, and"
        f" `git log {first}..{then}` what came between."
    )


def decided_since() -> str:
    """One item a definition that came after the thresholds: when, what, and what it moved."""
    return "\n".join(
        f"- `{one.commit}` ({one.date} UTC, {one.when}): {one.what} {one.moved}"
        for one in prespecified.decided_since().itertuples()
    )


def agreement(found: Sequence[Verdict], known: Iterable[Verdict], mark: str) -> str:
    """Whether the verdicts of a page's own runs are the published ones.

    Args:
        found: the page's own.
        known: the published ones.
        mark: what the page's own rest on, "180 runs trained for this page, 540 published".
    """
    there = {v.claim: v for v in known}
    other = [f"{v.claim} {v.words}" for v in _otherwise(found, there)]
    said = _compared(found, len(other), listed(other))
    return f"Judged alone, the runs of this page ({mark}) give the published outcome {said}."


def _otherwise(found: Sequence[Verdict], there: Mapping[str, Verdict]) -> list[Verdict]:
    """The verdicts that are decided, and not as the others on the same claims."""
    return [v for v in found if v.outcome not in (UNDECIDABLE, there[v.claim].outcome)]


def _compared(found: Sequence[Verdict], count: int, other: str) -> str:
    """Of how many claims there is the outcome that is asked for, `count` others, or none."""
    undecided = [v.claim for v in found if v.outcome == UNDECIDABLE]
    same = len(found) - len(undecided) - count
    parts = [f"for {same} of {len(found)} claims"]
    parts += [f"another for {count} ({other})"] * bool(count)
    parts += [f"none for {len(undecided)} (too few runs: {listed(undecided)})"] * bool(undecided)
    return listed(parts)


def repeated(found: Agreement) -> str:
    """How the published runs that were trained again came out, in two sentences."""
    if not found.runs:
        return "No published run was trained again here."
    there = {v.claim: v for v in found.there}
    other = [
        f"{v.claim}: {v.words} here, {there[v.claim].words} there"
        for v in _otherwise(found.here, there)
    ]
    return (
        f"Of {found.runs} published runs that were trained again on this machine, {found.equal}"
        f" have the published numbers in every digit, and {found.close} more to six digits."
        " Judged alone, they give the outcome of the published runs in the same layouts and"
        f" readings {_compared(found.here, len(other), '; '.join(other))}."
    )


def by_layout_and_decay(verdicts: Iterable[Verdict]) -> str:
    """On which claims the layouts, and the readings of the decay, disagree."""
    asked = [v for v in verdicts if v.by_layout]
    layouts = [v.claim for v in asked if v.differs_by("layout")]
    decays = [v.claim for v in asked if v.differs_by("decay")]
    if not asked:
        return ""
    turned = [v.claim for v in asked if v.turns]
    beside = (
        f" The learners of {listed(turned)} differ as claimed in one reading of the decay; in the"
        " other, more pairs go against the claim than with it."
    )
    return (
        f"Verdicts that are not the same in every layout: {listed(layouts)}; in both readings of"
        f" the decay: {listed(decays)}.{beside if turned else ''}"
    )


def verdicts_changed(judged: pd.DataFrame) -> str:
    """How many variants change a verdict; `judged` as `robustness.variant_changes` returns it."""
    variants = judged.variant.unique()
    if not len(variants):
        return ""
    changed = _changed(judged)
    return (
        f"Of {len(variants)} variants, each with one thing changed, {changed.variant.nunique()}"
        f" change at least one verdict, {changed[changed.p < SURE].variant.nunique()} of them with"
        f" p < {SURE}. {judged.p.notna().sum()} verdicts were compared, so that chance alone would"
        f" give about {SURE * judged.p.notna().sum():.0f} a p as small."
    )


def depends_on(verdicts: Iterable[Verdict], judged: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """The departures on which a verdict depends: letter -> claims, both in order."""
    found: dict[str, set[str]] = {letter: set() for letter in DEPARTURES}
    for verdict in verdicts:
        for field, letter in PARTS.items():
            if verdict.depends_on(field):
                found[letter].add(verdict.claim)
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


def judged(verdict: Verdict) -> str:
    """A claim, and what became of it, in a sentence of Markdown that links to what it rests on."""
    return f"{audit_link(verdict.claim)} (*{verdict.statement.rstrip('.')}*): **{verdict.words}**."


def outcomes(verdicts: Iterable[Verdict]) -> str:
    """One item a claim, in Markdown: what it says, and what became of it."""
    return "\n".join(
        f"- {audit_link(v.claim)}. {v.statement} *{v.words.capitalize()}.*" for v in verdicts
    )


def audits(verdicts: Iterable[Verdict]) -> str:
    """What each verdict rests on: a sentence of links, in Markdown."""
    return f"What each rests on: {listed(audit_link(v.claim) for v in verdicts)}."


def quotations(verdicts: Mapping[str, Verdict]) -> str:
    """One item a claim, in Markdown: its verdict, and the paper's words."""
    lines = []
    for name, one in verdicts.items():
        implied = " Taken for granted:" if CLAIMS[name].implied else ""
        words = f"**{audit_link(name)}**, *{one.words}*."
        lines.append(f"- {words}{implied} {CLAIMS[name].quotation}.")
    return "\n".join(lines)


def audit_link(claim: str) -> str:
    """A link from a claim's name to its thresholds, counts and evidence, in Markdown."""
    return f"[{claim}]({audit_place(claim)})"


def audit_place(claim: str) -> str:
    """Where that link leads."""
    name = WIDER_THAN.get(claim, claim)
    label = name.lower() if name in CLAIMS else "own"
    return f"for_reviewers.ipynb#reviewers-{label}"


def departure_link(words: str, letter: str) -> str:
    """A link to a departure's entry, in Markdown."""
    return f"[{words}](departures.ipynb#departure-{letter})"


def listed(names: Iterable[object]) -> str:
    """ "a, b and c", or "none"."""
    *most, last = [str(name) for name in names] or ["none"]
    return f"{', '.join(most)} and {last}" if most else last


def _changed(judged: pd.DataFrame) -> pd.DataFrame:
    return judged[judged.changes.astype(bool)]  # without rows the column has no type of its own
