"""What `book/syllabus.yml` declares: its keys are the fields of these classes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, NamedTuple

from driver.project import from_yaml

Titles = Mapping[str, Sequence[str]]  # of sections, by page


class Unknown(ValueError):
    """The syllabus names what is not there, or lacks a chapter; the message says which."""


@dataclass(frozen=True)
class Place:
    """A chapter among the others."""

    short: str  # title
    needs: Titles
    alone: Sequence[str] = ()  # sections that need nothing


class Discussion(NamedTuple):
    """What a unit discusses, and how long."""

    minutes: int = 0
    about: str = ""


@dataclass(frozen=True)
class Lesson:
    """What is declared of a unit."""

    title: str
    goals: Sequence[str]
    sections: Mapping[str, Sequence[str] | Literal["all"]]
    discussion: Discussion
    homework: str = ""


@dataclass(frozen=True)
class Part:
    """A part of the path through the book: steps, and chapters after them."""

    title: str
    steps: Sequence[str] = ()
    chapters: Sequence[str] = ()


@dataclass(frozen=True)
class Question:
    """A question of the self-test."""

    asks: str
    choices: Mapping[str, tuple[str, str]]  # a choice, and why it is right or wrong, by letter
    right: str
    read: str


@dataclass(frozen=True)
class Syllabus:
    """The whole file."""

    chapters: Mapping[str, Place]  # by page
    live: Mapping[str, str]  # where a live figure helps, by its cell
    plans: Mapping[str, Sequence[Lesson]]
    path: Sequence[Part]
    self_test: Sequence[Question]

    def place(self, page: str) -> Place:
        """Where a chapter stands."""
        if page not in self.chapters:
            raise Unknown(f"book/syllabus.yml does not say what {page} needs")
        return self.chapters[page]

    def helps(self, figure: str) -> str:
        """Where the live figure of this cell helps, for whoever teaches."""
        if figure not in self.live:
            raise Unknown(f"book/syllabus.yml does not say where the live figure {figure} helps")
        return self.live[figure]


@cache
def declared() -> Syllabus:
    """What `syllabus.yml` says."""
    said = from_yaml("book/syllabus.yml")
    return Syllabus(
        chapters={page: Place(**one) for page, one in said["chapters"].items()},
        live=said["live"],
        plans={name: [_lesson(**unit) for unit in units] for name, units in said["plans"].items()},
        path=[Part(**part) for part in said["path"]],
        self_test=[Question(**one) for one in said["self-test"]],
    )


def _lesson(discussion: dict[str, Any] | None = None, **said: Any) -> Lesson:
    return Lesson(discussion=Discussion(**discussion or {}), **said)
