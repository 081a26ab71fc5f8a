"""The numbers behind a verdict as sentences: one template a claim."""

from collections.abc import Mapping
from math import isfinite, isnan
from typing import Any

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.bench.learners import REFERENCE
from nmpcrl.bench.paired import IDLE, Ratio
from nmpcrl.claims.assumptions import THEOREMS
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_TIME, WIDER_THAN
from nmpcrl.claims.published import EVERY
from nmpcrl.claims.verdict import UNDECIDABLE, Verdict
from nmpcrl.report.cited import Count
from nmpcrl.report.text import listed
from nmpcrl.study.layouts import ARRIVED

EVIDENCE = {  # by claim; a wider claim has the template of the one that it widens
    "C1": "{DES_wrong} runs of DES and {RDES_wrong} of RDES diverged; their training cost ended at"
    " {DES_median:.2f} and {RDES_median:.2f} times the frozen arm's (medians; an episode that a"
    " failed solve cut short counts as ∞).",
    "C2": "{ES_wrong} runs of ES and {GES_wrong} of GES were unstable; in the second half the"
    " noise-free cost ranged over {ES_median:.1%} and {GES_median:.1%} (medians).",
    "C5": "The trajectories come to be {path:.2f} m apart, the noise-free costs differ by"
    " {cost:.1%} and the components of theta by up to {theta:.0%} (medians).",
    "C6": "On held-out pairs the error is {told:.1f} with theta and {alone:.1f} without (medians of"
    " the root mean square, in units of cost).",
    "C7": "{inputs:.0f} actions left their bounds. Of {steps_done:.0f} states in training,"
    " {inside_small:.0f}, {inside_medium:.0f} and {inside_large:.0f} lay in an obstacle by a small,"
    " a medium and a large Xi (up to 0.01, up to 0.1, and above; the largest is"
    " {worst_overlap:.3f}), and of those without noise {eval_inside_small:.0f},"
    " {eval_inside_medium:.0f} and {eval_inside_large:.0f} (the largest is"
    " {eval_worst_overlap:.3f}; by learner: {inside_without_noise}). {outside:.0f} states in"
    " training lay outside the box. Without noise, {kept} runs kept the constraints.",
    "C9": "Median reduction of the noise-free cost: {reductions}. Of the last rollouts of"
    " {learners}, {stuck} end more than {arrived} away from the target, and in {failed} runs one of"
    " the last three failed or training was stopped; they count.",
}
OWN = (  # of all our own claims
    "A run of {one} costs less than one of {other} with probability {better:.2f}; the noise-free"
    " cost was reduced by {first:+.1%} and {second:+.1%} (medians)."
)
BY_LEARNER = {  # of claims that speak of several learners, or are asked of several
    "C7": "Without noise, the constraints held in {counts}; states in an obstacle: {inside}.",
    "C9": "It holds in {counts}.",
}
LEVELS = {"decay": ("reading", " of the decay")}  # levels with a name of their own in sentences


class Shown(float):
    """A number that is formatted as ∞ where it is infinite."""

    def __format__(self, form: str) -> str:
        return shown(float(self), form)


def shown(value: float, form: str) -> str:
    """A number in a sentence; the cost of a run that failed is infinite."""
    return f"{value:{form}}" if isfinite(value) else str(value).replace("inf", "∞")


def evidence(verdict: Verdict) -> str:
    """The numbers behind a verdict, in sentences."""
    if verdict.claim in BY_TIME:
        return _times(verdict)
    if not verdict.levels:
        return _theorems(verdict)
    return " ".join([_numbers(verdict), _held(verdict), _scope(verdict)]).strip()


def by_learner(verdict: Verdict) -> str:
    """How often a claim holds for each learner that it speaks of; "" for other claims."""
    template = BY_LEARNER.get(_widened(verdict), "")
    counts = [f"{Count(*count)} runs of {name}" for name, count in verdict.by_learner.items()]
    inside = verdict.numbers.get("eval_inside", {})
    states = ", ".join(f"{count:.0f} of {name}" for name, count in inside.items())
    return template.format(counts=", ".join(counts) or "no run", inside=states)


def _widened(verdict: Verdict) -> str:
    return WIDER_THAN.get(verdict.claim, verdict.claim)


def _numbers(verdict: Verdict) -> str:
    """The further numbers of a claim that runs decide."""
    numbers = verdict.numbers
    if verdict.claim not in EVERY or not (numbers or verdict.claim in OWN_CLAIMS):
        return ""
    learners = EVERY[verdict.claim].learners
    if verdict.claim in OWN_CLAIMS:
        first, second = learners
        if not numbers:
            return f"{first} and {second} were not run together."
        return OWN.format(one=first, other=second, **_formatted(numbers))
    kept = [sum(column) for column in zip(*verdict.by_learner.values(), strict=True)] or [0, 0]
    inside, medians = numbers.get("eval_inside", {}), numbers.get("medians", {})
    return EVIDENCE[_widened(verdict)].format(
        **_formatted(numbers),
        kept=Count(*kept),
        inside_without_noise=", ".join(f"{name} {count:.0f}" for name, count in inside.items()),
        reductions=", ".join(f"{name} {shown(one, '+.1%')}" for name, one in medians.items()),
        learners=listed(learners),
        arrived=ARRIVED,
    )


def _formatted(numbers: Mapping[str, Any]) -> dict[str, Any]:
    counts = {name: Count(*one) for name, one in numbers.items() if isinstance(one, tuple)}
    floats = {name: Shown(one) for name, one in numbers.items() if isinstance(one, float)}
    return {**numbers, **counts, **floats}


def _held(verdict: Verdict) -> str:
    """In how many runs or pairs the claim holds."""
    missing = f"; {verdict.missing} {verdict.unit} are missing" * bool(verdict.missing)
    if verdict.share is None or verdict.interval is None:
        return f"No {verdict.unit} are there to be asked{missing}."
    share, count = Estimate(verdict.share, *verdict.interval), Count(*verdict.counts["all"])
    return f"It holds in {count} {verdict.unit}: {share:.0%}{missing}."


def _scope(verdict: Verdict) -> str:
    """The number of layouts, readings of the decay and seeds, or of other levels."""
    parts = []
    for level, n in verdict.levels.items():
        name, rest = LEVELS.get(level, (level, ""))
        parts.append(f"{n} {name}{'' if n == 1 else 's'}{rest}")
    return f"({', '.join(parts)}.)"


def _times(verdict: Verdict) -> str:
    claim, ratios = BY_TIME[verdict.claim], verdict.numbers
    if not ratios:
        return f"{claim.learner} and {REFERENCE} were not timed with {claim.solver}."
    by_solver = ", ".join(f"{value} with {solver}" for solver, value in ratios.items())
    taken = f"A step of {claim.learner} takes, in steps of {REFERENCE}, {by_solver}: {claim.work}."
    if verdict.outcome != UNDECIDABLE:
        return taken
    return f"{taken} Not decidable here: {_doubt(ratios[claim.solver])}."


def _doubt(ratio: Ratio) -> str:
    """Why a ratio decides nothing; a machine without other work makes it wait less than `IDLE`."""
    if isnan(ratio.low) or isnan(ratio.high):
        return "too few steps were timed"
    if ratio.waited > IDLE:
        return f"the machine was too busy, the process waited for {ratio.waited:.0%} of the time"
    return "the interval reaches across a border of the claim"


def _theorems(verdict: Verdict) -> str:
    made = {name: [a for a in verdict.assumptions if name in a.by] for name in THEOREMS}
    counts = " and ".join(
        f"{sum(not a.holds for a in of)} of {len(of)} of {name}" for name, of in made.items() if of
    )
    broken = "; ".join(a.theorem for a in verdict.assumptions if not a.holds)
    return (
        f"Of the assumptions of the two theorems that are cited, {counts} do not hold for what is"
        f" run{f': {broken}' if broken else ''}."
    )
