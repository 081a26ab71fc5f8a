"""The commit that fixed the thresholds and the rule, and the definitions that came later.

It is the first commit since which every committed state of the code has had each of `NUMBERS`, by
name and value, as it is today; the code around them may have changed. The manifest of the published
data names it, and a test compares it with git. The questions of an investigation are registered by
the commit that the manifest names for it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nmpcrl.analysis import metrics
from nmpcrl.claims import rule, thresholds

MODULES = {  # with the thresholds, and the numbers of the rule for shares
    thresholds: "DIVERGED UNSTABLE HALF SAME_TIME SAME_PATH SAME_COST MORE_ACCURATE BETTER"
    " NEAR_HALF NEAR_SAME_TIME",
    rule: "MAJORITY NEARLY_ALL NEARLY_NONE",
    metrics: "TOUCH",
}
NUMBERS = {name: getattr(home, name) for home, names in MODULES.items() for name in names.split()}


@dataclass(frozen=True)
class Commit:
    """One state of the code, and when it was committed."""

    hash: str
    date: str  # "2026-11-21 13:21", UTC


@dataclass(frozen=True)
class Decision:
    """A definition that came after the thresholds, which did not change."""

    commit: str
    date: str  # as in `Commit`
    when: str  # what had been seen by then
    what: str  # the definition, in a sentence
    moved: str  # its effect, in a sentence


SINCE = (  # in the order in which they were made
    Decision(
        "b82880deae",
        "2026-11-21 13:40",
        "before the runs were published",
        "The final cost of a run that had to be stopped is infinite, in every claim.",
        "C9 holds in 135 of 240 runs and not in 139; no outcome changed.",
    ),
    Decision(
        "9cc97081fa",
        "2026-11-21 21:50",
        "after the verdicts had been seen",
        "The time of a step is the processor's, compared in pairs of steps, with an interval; it"
        " had been a ratio of two medians.",
        "No outcome changed.",
    ),
    Decision(
        "ad7adf081b",
        "2026-11-22 03:59",
        "after the verdicts had been seen",
        "Both halves of C1 and C2 are counted by themselves, in each reading and layout: what"
        " clearly differs there was found by looking.",
        "This is no part of a verdict.",
    ),
    Decision(
        "417746ef7c",
        "2026-11-22 11:48",
        "after the verdicts had been seen",
        "A verdict depends on the decay where its outcome differs between the readings, and where"
        " two learners clearly differ as claimed in one and the other way round in the other.",
        "C1 depends on the decay, and not C6 alone; no outcome changed.",
    ),
    Decision(
        "04d72040bf",
        "2026-11-23 20:25",
        "after the verdicts had been seen, in one commit with those of the new questions",
        "Each claim is judged as the paper makes it: C7 is asked of RDES alone, of which the paper"
        " says it, and C8 of both theorems that are cited; the same of all four learners are W7 and"
        " W9.",
        "C7 is asked of 120 runs and not of 480; no outcome changed.",
    ),
    Decision(
        "04d72040bf",
        "2026-11-23 20:25",
        "after the verdicts had been seen, in one commit with the new times",
        "A ratio of times is that of the sums over the same steps, so that the times of a table"
        " divide to it; it had been a median of ratios.",
        "C3 had been 0.63 and C4 1.00, on another machine as well; no outcome changed.",
    ),
    Decision(
        "79349da7d2",
        "2026-11-28 09:51",
        "after the verdicts had been seen",
        "The halves of C1 and C2 are compared by the claim's own measure, over a whole reading of"
        " the decay. C1 depends on the decay because it is as claimed in one reading, and in the"
        " other more pairs go against it.",
        "The reverse of C1 per episode, and of C2, is no longer said: it had rested on layouts and"
        " on a second measure that were chosen after looking. No outcome changed.",
    ),
    Decision(
        "79349da7d2",
        "2026-11-28 09:51",
        "after the drawn layouts had been seen",
        "The weaker question of C7 and W7, which was fixed with the thresholds, counts in the drawn"
        " layouts as it does in A to F. What was registered for these layouts reads the first"
        ' question alone, and expected "not reproduced".',
        "C7 and W7 are partly reproduced there, and had been not reproduced; 7 of 9 verdicts stand"
        " there, and had been 5.",
    ),
)


@dataclass(frozen=True)
class Fixed:
    """The commit that fixed the thresholds, and the one that published the first runs."""

    thresholds: Commit
    published: Commit  # a descendant of the other


def fixed(about: Mapping[str, Any]) -> Fixed | None:
    """The two commits; None if the manifest has other numbers than today's.

    Args:
        about: of `published.load()`.
    """
    known = about.get("fixed")
    today = {name: list(one) if isinstance(one, tuple) else one for name, one in NUMBERS.items()}
    if not known or known["numbers"] != today:
        return None
    return Fixed(Commit(**known["thresholds"]), Commit(**known["published"]))
