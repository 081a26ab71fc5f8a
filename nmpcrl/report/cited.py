"""Numbers that carry where they come from, in the page and for whoever points at them.

`<data value="27" title="diverged: 720 runs published">27</data>`: what stands in `title` names the
quantity, and two numbers of one quantity are one number, wherever they stand. A test collects them
from all pages and puts them to `agreement.disagreements`.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.bench.paired import Ratio


class Count(NamedTuple):
    """So many of so many."""

    yes: int
    of: int

    def __str__(self) -> str:
        return f"{int(self.yes)} of {int(self.of)}"

    def __format__(self, form: str) -> str:
        return format(str(self), form)


@dataclass(frozen=True)
class Cited:
    """A number that carries what it is of into any text."""

    value: Any
    quantity: str

    def __format__(self, form: str) -> str:
        return cited(finite(self.value, form), self.value, self.quantity)

    def __str__(self) -> str:
        return format(self)


def cited(text: str, value: Any, quantity: str) -> str:
    """A number as a page shows it, in Markdown or HTML, with its value and what it is of.

    Args:
        text: as it is shown, "27 %".
        value: which that is, to all digits, such as 0.2681.
        quantity: what it is of, whose, and from where.
    """
    exact, what = escape(_exact(value)), escape(quantity)
    return f'<data value="{exact}" title="{what}">{text}</data>'


def by_reading(
    name: str, form: str, values: Iterable[float], decays: Iterable[str], origin: str
) -> str:
    """The median over the runs for each decay of the noise: "0.74 (per step) and 0.44 (...)".

    Args:
        name: of the number.
        form: of a median, ".2f".
        values: the number of each run.
        decays: the reading of each run.
        origin: whose numbers these are and from where.
    """
    medians = pd.Series([*values], dtype=float).groupby([*decays], sort=False).median()
    return " and ".join(
        f"{cited(finite(at, form), at, f'{name} per {decay}: {origin}')} (per {decay})"
        for decay, at in medians.items()
    )


def finite(value: Any, form: str) -> str:
    """A number in a format; of one that is infinite, as the cost of a run that failed, ∞."""
    return format(value, form).replace("inf%", "∞").replace("inf", "∞")


def is_number(value: Any) -> bool:
    """Whether it is a number, an estimate or a count, and no text that holds one."""
    known = int | float | np.number | Count | Estimate | Ratio
    return isinstance(value, known) and not isinstance(value, bool | np.bool_)


def _exact(value: Any) -> str:
    if isinstance(value, Estimate | Ratio):
        return f"{value.value!r} [{value.low!r}, {value.high!r}]"
    return str(value) if isinstance(value, Count) else repr(float(value))
