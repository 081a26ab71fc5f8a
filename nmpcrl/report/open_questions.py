"""What one should ask the authors, and which of our verdicts the answers would decide."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from nmpcrl.report.text import departure_link, listed


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


def question_list(decides: Mapping[str, Collection[str]], varied: Collection[str]) -> str:
    """The questions as a numbered list in Markdown, each with what depends on it here.

    Args:
        decides: claims whose verdicts depend on a departure, by its letter.
        varied: the letters of the departures that were read in several ways.
    """
    return "\n".join(
        f"{number}. **{question.ask}** {_links(question)} {_decided(question, decides, varied)}"
        for number, question in enumerate(QUESTIONS, start=1)
    )


def asked(decides: Mapping[str, Collection[str]]) -> str:
    """The questions on which a verdict depends as a numbered list in Markdown, and which."""
    return "\n".join(
        f"{number}. {question.ask} (It bears on {listed(claims)}.)"
        for number, (question, claims) in enumerate(_bearing(decides), start=1)
    )


def _bearing(decides: Mapping[str, Collection[str]]) -> list[tuple[Question, list[str]]]:
    """The questions on which a verdict depends, each with its claims."""
    found = [(question, _decides(question, decides)) for question in QUESTIONS]
    return [(question, claims) for question, claims in found if claims]


def _decides(question: Question, decides: Mapping[str, Collection[str]]) -> list[str]:
    return sorted({claim for one in question.departures for claim in decides.get(one, ())})


def _links(question: Question) -> str:
    refs = " and ".join(departure_link(letter, letter) for letter in question.departures)
    return f"(departure{'s' if len(question.departures) > 1 else ''} {refs})."


def _decided(
    question: Question, decides: Mapping[str, Collection[str]], varied: Collection[str]
) -> str:
    if claims := _decides(question, decides):
        return f"The answer decides {listed(claims)} here."
    if set(question.departures) & set(varied):
        return "No verdict depends on it in what was run."
    return "It was not varied here."
