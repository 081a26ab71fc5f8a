"""What a check says of an answer: it is right, or it is not, and then why.

The functions of this package return an `Outcome` for a right answer and raise `Unsolved` for any
other. An `exercise` of a chapter raises only in an edition for students and in a build of the book,
where NMPCRL_STRICT is set when this is imported; elsewhere it says the same, in an `Outcome` that
is not right, and the chapter runs to its end.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from nmpcrl.study.refusal import Refusal

MIME = "application/vnd.nmpcrl.check+json"  # of what the page is given
STRICT = bool(os.environ.get("NMPCRL_STRICT"))  # no answer can change it later
UNANSWERED = "Not answered yet: put your answer where the dots are, run that cell, then this one."

P = ParamSpec("P")
Check = TypeVar("Check", bound=Callable[..., Any])


class Unsolved(Refusal):
    """An answer is missing or wrong; the message is a sentence that helps."""


@dataclass(frozen=True)
class Outcome:
    """What a check says."""

    said: str
    page: Mapping[str, Any] | None = None  # with which the page checks the same answer
    right: bool = True

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


def exercise(check: Callable[P, Outcome]) -> Callable[P, Outcome]:
    """The check of an exercise, which a chapter calls: unless it has to, it does not raise."""

    @wraps(check)
    def said(*args: P.args, **kwargs: P.kwargs) -> Outcome:
        try:
            return check(*args, **kwargs)
        except Unsolved as unsolved:
            if STRICT:
                raise
            return Outcome(str(unsolved), right=False)

    return said


def varied(**numbers: tuple[float, float, float]) -> Callable[[Check], Check]:
    """A check of which a number of the question may have another value, as `variants` draws it.

    Args:
        numbers: of an argument, whose default the question prints, the least value, the largest
            one, and the step between two.
    """

    def marked(check: Check) -> Check:
        vars(check)["varied"] = numbers
        return check

    return marked
