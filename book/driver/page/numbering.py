"""Figures of a page without a number are counted on that page, as its source counts them.

Sphinx counts them through all such pages.
"""

from typing import Any

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

LAST = 900  # of the listeners to an event, behind Sphinx's own that numbers


def count_anew(_: Sphinx, environment: BuildEnvironment) -> list[str]:
    """Number figures, tables and code of each unnumbered page from one; no page is read again."""
    for kinds in environment.toc_fignumbers.values():
        for kind, numbers in kinds.items():
            if all(len(number) == 1 for number in numbers.values()):
                kinds[kind] = {label: (k,) for k, label in enumerate(numbers, 1)}
    return []


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the listener."""
    app.connect("env-get-updated", count_anew, priority=LAST)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
