"""The commit that fixed the thresholds and the rule, and the definitions that came later.

The manifest of the published data names the commit; a test compares `NUMBERS` with every later
state of the code. `decided_since.csv` lists later definitions.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from nmpcrl.analysis import metrics
from nmpcrl.claims import rule, thresholds

MODULES = {  # with the thresholds, and the numbers of the rule for shares
    thresholds: "DIVERGED UNSTABLE HALF SAME_TIME SAME_PATH SAME_COST MORE_ACCURATE BETTER"
    " NEAR_HALF NEAR_SAME_TIME",
    rule: "MAJORITY NEARLY_ALL NEARLY_NONE",
    metrics: "TOUCH",
}
NUMBERS = {name: getattr(home, name) for home, names in MODULES.items() for name in names.split()}


def fixed(about: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Hash and date (UTC) of two commits: "thresholds" fixed, and first runs "published".

    `about` is a field of `published.load()`. Empty if the manifest has other numbers than the code.
    """
    known = {**about.get("fixed", {})}
    today = {name: list(one) if isinstance(one, tuple) else one for name, one in NUMBERS.items()}
    return known if known.pop("numbers", {}) == today else {}


def decided_since() -> pd.DataFrame:
    """The definitions that came after the thresholds, in order: commit, date, when, what, moved."""
    return pd.read_csv(Path(__file__).with_name("decided_since.csv"), dtype=str)
