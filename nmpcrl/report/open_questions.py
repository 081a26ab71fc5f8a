"""What one should ask the authors, and which of our verdicts the answers would decide."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from nmpcrl.report.text import listed


@dataclass(frozen=True)
class Question:
    """One gap of the paper as a question."""

    ask: str
    departures: tuple[str, ...]  # that read what is asked for; in the order of their weight


QUESTIONS = (
    Question("Where do the centres of the four obstacles lie?", ("B",)),
    Question("What is $c_\\epsilon$, and does its exponent count time steps or episodes?", ("C",)),
    Question(
        "What makes a run diverge or unstable, and two policies the same? How many runs stand"
        " behind each curve?",
        ("P",),
    ),
    Question(
        "Which activation, initial weights, scaling, buffer and number of fits a step has the"
        " network, and does $\\boldsymbol{\\theta}$ wait for the first fit?",
        ("H", "G"),
    ),
    Question("Does DES differ from RDES in the network's inputs only?", ("I",)),
    Question(
        "Is the state space $[-3, 9]^2$, and are its bounds hard, as they are written?", ("A", "M")
    ),
    Question("Is $\\beta$ meant to be smaller than $\\alpha$?", ("J",)),
    Question(
        "Is the first input free in the value that is learned, and are noisy actions clipped?",
        ("F", "E"),
    ),
    Question(
        "Which solver was used, and what does it return where $V$ has a kink in $\\theta_c$?",
        ("L",),
    ),
)


def asked(decides: Mapping[str, Collection[str]]) -> str:
    """The questions on which a verdict depends as a numbered list in Markdown, and which.

    Args:
        decides: claims whose verdicts depend on a departure, by its letter.
    """
    lines: list[str] = []
    for question in QUESTIONS:
        claims = sorted({claim for one in question.departures for claim in decides.get(one, ())})
        if claims:
            bears = f"(It bears on {listed(claims)}.)"
            lines.append(f"{len(lines) + 1}. {question.ask} {bears}")
    return "\n".join(lines)
