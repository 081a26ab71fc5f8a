"""JSON files of measurements with a hash of their content, so that a change by hand is noticed."""

import json
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from nmpcrl.study.files import write_json
from nmpcrl.study.machine import machine
from nmpcrl.study.provenance import environment, hash_of

Made = TypeVar("Made")
DAMAGE = (OSError, ValueError, LookupError, TypeError)


def save(path: Path, content: Mapping[str, Any]) -> None:
    """Write the content and its hash."""
    write_json(path, {**content, "seal": hash_of(content)}, indent=1)


def read(
    path: Path, make: Callable[[Any], Made], damaged: Callable[[str], Exception], command: str
) -> Made:
    """Make a value of the content of a file; raise `damaged` where this fails."""
    try:
        content: dict[str, Any] = json.loads(path.read_text("utf-8"))
        if content.pop("seal") != hash_of(content):
            raise ValueError("it is not the file that was written")
        return make(content)
    except DAMAGE as error:
        raise damaged(f"{path} is missing or damaged ({error}); `{command}` makes one") from error


def about(seconds: float) -> dict[str, Any]:
    """Date, duration, machine and versions of a measurement that ended now."""
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "seconds": seconds,
        "machine": machine(),
        "versions": environment(),
    }
