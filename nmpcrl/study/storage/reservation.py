"""Which runs processes that share a folder are training, so that none is trained twice.

A process notes in `.reservations` which runs it is training, and holds a lock of the system next to
its note as long as it runs. The note of a killed process is therefore recognised on every machine
that sees the folder, and the next process that looks removes it. Where there are no such locks, or
the folder cannot be written, nothing is reserved: a run may be trained twice, with the same result.
"""

import json
import os
import secrets
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from filelock import BaseFileLock, FileLock

PLACE = ".reservations"
PATIENCE = 20.0  # [s]; longer than that, only who was stopped keeps the notes to himself


class Reservations:
    """The runs that one process is at in a folder, among those that all are at; by name."""

    def __init__(self, folder: Path) -> None:
        self._place = folder / PLACE
        self._note = self._place / f"{os.getpid()}-{secrets.token_hex(4)}.json"
        self._alive: BaseFileLock | None = None  # held as long as there is a note
        self._own: set[str] = set()
        self._threads = threading.Lock()

    def take(self, names: Iterable[str]) -> set[str]:
        """Reserve those that nobody is at, until they are released; which ones these are."""
        with self._threads:
            free = set(names) - self._own
            with suppress(OSError), self._alone():
                free -= self._others()
                self._write(self._own | free)
            self._own |= free
            return free

    def release(self, names: Iterable[str]) -> None:
        """Let others have what was reserved."""
        with self._threads:
            self._own -= set(names)
            with suppress(OSError), self._alone():
                self._write(self._own)

    def taken(self, names: Iterable[str]) -> set[str]:
        """Those that somebody is at."""
        with self._threads:
            found = set(self._own)
            with suppress(OSError), self._alone():
                found |= self._others()
            return found & set(names)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Nobody else reads or writes notes; the file of this lock is never removed."""
        self._place.mkdir(parents=True, exist_ok=True)
        with FileLock(self._place / "lock", timeout=PATIENCE):
            yield

    def _others(self) -> set[str]:
        """What all living ones but this process are at; the notes of others go."""
        names: set[str] = set()
        for alive in self._place.glob("*.alive"):
            note = alive.with_suffix(".json")
            if note == self._note:
                continue
            lock = FileLock(alive, timeout=0)
            try:
                lock.acquire()
            except OSError:  # it is held
                names |= _read(note)
            else:
                note.unlink(missing_ok=True)
                alive.unlink()
                lock.release()
        return names

    def _write(self, names: set[str]) -> None:
        """Note what this process is at; without anything, take the note away."""
        alive = self._note.with_suffix(".alive")
        if names and self._alive is None:
            lock = FileLock(alive, thread_local=False)
            lock.acquire(timeout=0)
            self._alive = lock
        if names:
            self._note.write_text(json.dumps(sorted(names)), "utf-8")
        elif self._alive is not None:
            self._note.unlink(missing_ok=True)
            alive.unlink(missing_ok=True)
            self._alive.release()
            self._alive = None


def reservations(folder: Path) -> Reservations:
    """Those of this process in a folder."""
    return _of(os.getpid(), folder.resolve())


@contextmanager
def reserved(folder: Path, name: str, wait: Callable[[], object]) -> Iterator[None]:
    """Be at a run, alone; as long as somebody else is, `wait` is called."""
    mine = reservations(folder)
    while not mine.take([name]):
        wait()
    try:
        yield
    finally:
        mine.release([name])


@cache
def _of(process: int, folder: Path) -> Reservations:
    """One a process: a fork has its own."""
    return Reservations(folder)


def _read(note: Path) -> set[str]:
    try:
        return set(json.loads(note.read_text("utf-8")))
    except (OSError, ValueError):  # its writer found no room for it
        return set()
