"""Of tests that take too long for each push, a tenth a day: each runs once in ten days."""

from collections.abc import Iterable
from datetime import date
from hashlib import sha256

PARTS = 10


def tenth_of(name: str) -> int:
    """In which tenth the test of this name is, on every machine."""
    return int(sha256(name.encode()).hexdigest(), 16) % PARTS


def asked(option: str) -> int:
    """A tenth by its number from 0, or "today": by the date, another each day."""
    return date.today().toordinal() % PARTS if option == "today" else int(option) % PARTS


def split(names: Iterable[str], tenth: int) -> tuple[list[str], list[str]]:
    """The names in a tenth, and the others."""
    chosen: tuple[list[str], list[str]] = ([], [])
    for name in names:
        chosen[tenth_of(name) != tenth].append(name)
    return chosen
