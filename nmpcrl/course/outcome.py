"""What a check says of an answer: it is right, it is not there yet, or it is wrong, and then why.

A right answer is an `Outcome`, which a notebook shows as a sentence. A wrong one raises `Unsolved`.
An exercise that nobody has answered says so and lets the chapter run to its end; in an edition for
students, where NMPCRL_STRICT is set, it raises, too, so that it counts as unsolved.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nmpcrl.study.parameters import Refusal

MIME = "application/vnd.nmpcrl.check+json"  # of what the page is given
STRICT = "NMPCRL_STRICT"
UNANSWERED = "Not answered yet: put your answer where the dots are, run that cell, then this one."


class Unsolved(Refusal):
    """An answer is missing or wrong; the message is a sentence that helps."""


@dataclass(frozen=True)
class Outcome:
    """What a check returns."""

    said: str
    page: Mapping[str, Any] | None = None  # with which the page checks the same answer

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        """The sentence, and what the page is given."""
        return {"text/plain": self.said} | ({MIME: dict(self.page)} if self.page else {})


def unanswered() -> Outcome:
    """What is said where `...` still stands.

    Raises:
        Unsolved: in an edition for students.
    """
    if os.environ.get(STRICT):
        raise Unsolved(UNANSWERED)
    return Outcome(UNANSWERED)
