"""What a check says of an answer: a right one gets an `Outcome`, any other an `Unsolved`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nmpcrl.study.refusal import Refusal

MIME = "application/vnd.nmpcrl.check+json"  # of what the page is given
UNANSWERED = "Not answered yet: put your answer where the dots are, run that cell, then this one."


class Unsolved(Refusal):
    """An answer is missing or wrong; the message is a sentence that helps."""


@dataclass(frozen=True)
class Outcome:
    """What a check says of a right answer."""

    said: str
    page: Mapping[str, Any] | None = None  # with which the page checks the same answer

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        """The sentence, and what the page is given."""
        return {"text/plain": self.said} | ({MIME: dict(self.page)} if self.page else {})


def refuse_unanswered(answer: Any) -> None:
    """Refuse the three dots.

    Raises:
        Unsolved: nothing has been put in their place.
    """
    if answer is ...:
        raise Unsolved(UNANSWERED)
