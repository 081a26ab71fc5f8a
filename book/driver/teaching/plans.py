"""Plans for a course: the units that `syllabus.yml` declares, with minutes and exercises.

Sections take longer to teach than to read. What is left of a unit goes to the exercises of its
chapters in their order, at most half of them before a chapter's last unit; those that do not fit
are homework after it.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from driver.teaching.declared import Discussion, Lesson, declared
from driver.teaching.syllabus import Chapter, Section, chapters, minutes
from nmpcrl.course.exercises import Exercise

UNIT = 90  # minutes
QUESTIONS = 8  # minutes of each unit, at least, that nothing else takes
PACE = 1.5  # minutes of a lecture for one of reading
LIVE = 10  # minutes with a live figure


@dataclass(frozen=True, eq=False)
class Unit:
    """What is taught at a stretch."""

    title: str
    goals: tuple[str, ...]
    sections: tuple[Section, ...]
    exercises: tuple[Exercise, ...]
    discussion: Discussion
    homework: tuple[Exercise, ...]
    besides: str  # other homework
    left_out: tuple[Section, ...]  # of the chapters that end here

    @property
    def live(self) -> tuple[Section, ...]:
        """The sections with a live figure."""
        return tuple(one for one in self.sections if one.live)

    @property
    def minutes(self) -> dict[str, int]:
        """Minutes by what they are spent on."""
        return {
            "lecture": lecture(self.sections),
            "live figures": LIVE * sum(one.live for one in self.sections),
            "exercises": sum(one.about.minutes for one in self.exercises),
            "discussion": self.discussion.minutes,
        }

    @property
    def total(self) -> int:
        return sum(self.minutes.values())


def lecture(sections: Sequence[Section]) -> int:
    """Minutes that it takes to teach sections."""
    return math.ceil(PACE * minutes(list(sections)))


def plan(name: str) -> list[Unit]:
    """The units of a plan in their order."""
    return list(_units(declared().plans[name]))


def _units(lessons: Sequence[Lesson]) -> Iterator[Unit]:
    taught = [_sections(lesson) for lesson in lessons]
    covered = {one.label for sections in taught for one in sections}
    last = {page: k for k, lesson in enumerate(lessons) for page in lesson.sections}
    waiting = {page: _to_solve(chapters()[page]) for page in last}
    for k, (lesson, sections) in enumerate(zip(lessons, taught, strict=True)):
        ending = [page for page in lesson.sections if last[page] == k]
        begun = Unit(
            title=lesson.title,
            goals=tuple(lesson.goals),
            sections=sections,
            exercises=(),
            discussion=lesson.discussion,
            homework=(),
            besides=lesson.homework,
            left_out=tuple(
                one
                for page in ending
                for one in chapters()[page].sections
                if one.label not in covered
            ),
        )
        yield _filled(begun, list(lesson.sections), ending, waiting)


def _filled(
    unit: Unit, pages: list[str], ending: list[str], waiting: dict[str, list[Exercise]]
) -> Unit:
    """The unit with the exercises that fit, which wait no longer, and with its homework."""
    solved, room = [], UNIT - QUESTIONS - unit.total
    for page in pages:
        share = len(waiting[page]) if page in ending else len(waiting[page]) // 2
        for one in waiting[page][:share]:
            if one.about.minutes <= room:
                waiting[page].remove(one)
                solved.append(one)
                room -= one.about.minutes
    later = [one for page in ending for one in waiting[page]]
    return replace(unit, exercises=tuple(solved), homework=tuple(later))


def _sections(lesson: Lesson) -> tuple[Section, ...]:
    """The sections of a unit; "all" means each one of a chapter.

    Raises:
        Unknown: one of them is not there.
    """
    known = chapters()
    return tuple(
        one
        for page, titles in lesson.sections.items()
        for one in (known[page].sections if titles == "all" else map(known[page].section, titles))
    )


def _to_solve(chapter: Chapter) -> list[Exercise]:
    """The exercises of a chapter without its project."""
    return [one for one in chapter.exercises if one.about.kind != "project"]
