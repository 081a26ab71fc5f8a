"""JSON files with a seal, a hash of all else in them, so that a change by hand is noticed."""

import json
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from nmpcrl.study.files import write_json
from nmpcrl.study.provenance import environment, hash_of
from nmpcrl.study.storage.machine import machine

Made = TypeVar("Made")
DAMAGE = (OSError, ValueError, LookupError, TypeError)  # what is raised where a file is not whole


def seal_of(content: Mapping[str, Any]) -> str:
    """The hash of all but the seal."""
    return hash_of({name: value for name, value in content.items() if name != "seal"})


def keep(path: Path, content: Mapping[str, Any], indent: int | None = None) -> None:
    """Write it with its seal."""
    whole = {**content, "seal": seal_of(content)}
    write_json(path, whole, indent)


def content_of(path: Path) -> dict[str, Any]:
    """What is there, if it is what was written; else one of `DAMAGE` is raised."""
    content: dict[str, Any] = json.loads(path.read_text("utf-8"))
    if content["seal"] != seal_of(content):
        raise ValueError("it is not what was written")
    return content


def read(
    path: Path, made: Callable[[Any], Made], damaged: Callable[[str], Exception], command: str
) -> Made:
    """What is `made` of the content; else `damaged` is raised, and says which `command` helps."""
    try:
        return made(content_of(path))
    except DAMAGE as error:
        raise damaged(f"{path} is missing or damaged ({error}); `{command}` makes one") from error


def about(seconds: float) -> dict[str, Any]:
    """When, in how many seconds, on which machine and with what something was made just now."""
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "seconds": seconds,
        "machine": machine(),
        "versions": environment(),
    }
