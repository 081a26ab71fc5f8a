"""The robustness analysis: a map of the verdicts, and what lies behind some of its cells."""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.rows import experiment_of
from nmpcrl.analysis.summary import Outline
from nmpcrl.claims.by_runs import RunClaim, Values
from nmpcrl.claims.evidence import Evidence, paths
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.robustness import WHOLE, groups
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report.figures.axes import over_episodes, plain
from nmpcrl.report.figures.sheet import in_words, sheet
from nmpcrl.report.figures.style import LIMIT, LOOKS, headed, marked, page, subplots
from nmpcrl.report.tables import WORDS
from nmpcrl.study.experiment import Experiment

FILLS = {  # with the colour of the word; the darker, the more is left of the claim
    REPRODUCED: ("#1a6b3c", "white"),
    PARTLY: ("#e0b050", "black"),
    NOT: ("#f6d5d2", "black"),
    UNDECIDABLE: ("white", "0.45"),
}
SYMBOLS = {"c_epsilon": r"$c_\epsilon$", "alpha x": "α ×", "beta x": "β ×"}
ABREAST = 3  # claims side by side on a narrow sheet
LETTERS = -2.15  # where the letters of the departures stand, in widths of a cell
FOLD = {False: 13, True: 10}  # characters of a line above a column, wide and narrow
SMALL: dict[str, Any] = {"va": "center", "fontsize": "small"}
FEW_ROWS = 10  # of the map on a low sheet
RISEN = 1.05  # of theta_init's cost: what is above counts as a rise


@page
def verdict_map(judged: pd.DataFrame, mark: str) -> Figure:
    """What becomes of each claim in each row, framed where it is not what it is compared with.

    On a low sheet the rows are those whose changes chance explains least.

    Args:
        judged: of `robustness_map`.
        mark: where the runs come from.
    """
    finding = _changed(judged)
    if sheet().low:
        judged = _surest(judged)
    claims, rows = list(judged.claim.unique()), list(judged.variant.unique())
    letters = dict(zip(judged.variant, judged.departure, strict=True))
    height = dict(zip(rows, _heights([letters[row] for row in rows]), strict=True))
    last = max(height.values(), default=0.0)
    side = max(1, ABREAST if sheet().narrow else len(claims))
    parts = [claims[i : i + side] for i in range(0, len(claims), side)] or [[]]
    tall = len(parts) * (0.2 * last + 1.0) + 0.6
    figure, panels = subplots(len(parts), 1, 0.22 * last + 1.5, squeeze=False, tall=tall)
    for axes, part in zip(panels.flat, parts, strict=True):
        for cell in judged[judged.claim.isin(part)].to_dict("records"):
            _cell(axes, part.index(cell["claim"]), height[cell["variant"]], cell)
        for row, y in height.items():
            axes.text(-0.1, y, named(row), ha="right", **SMALL)
            if height[row] == min(height[one] for one in rows if letters[one] == letters[row]):
                axes.text(LETTERS, y, letters[row], ha="left", **SMALL)
        axes.text(LETTERS, -0.8, "departure", ha="left", **(SMALL | {"va": "bottom"}))
        for i, claim in enumerate(part):
            head = f"{claim}\n{_folded(BY_RUNS[claim].short, FOLD[sheet().narrow])}"
            axes.text(i + 0.5, -0.8, head, ha="center", **(SMALL | {"va": "bottom"}))
        axes.set(xlim=(LETTERS, side), ylim=(last + 0.7, -5.2))
        axes.set_axis_off()
    return marked(headed(figure, finding), mark)


@page
def clearest_changes(cells: pd.DataFrame, found: Evidence) -> Figure:
    """What lies behind some cells: a row each, the claim's measure and the costs of its runs.

    On a low sheet there is the first alone.

    Args:
        cells: of `robustness.clearest_changes`.
        found: runs and summaries of the main table and of the variants.
    """
    if cells.empty:
        figure, axes = subplots(height=0.6)
        axes.set_axis_off()
        return headed(figure, "No verdict changes in what was run here")
    if sheet().low:
        cells = cells.head(1)
    figure, grid = subplots(len(cells), 2, 2.5 * len(cells) + 0.3, squeeze=False, rowwise=True)
    for (left, right), cell in zip(grid, cells.to_dict("records"), strict=True):
        here, base = groups(found.runs, cell["variant"])
        claim, where = BY_RUNS[cell["claim"]], paths(found)
        values = claim.measure(here, where), claim.measure(base, where)
        _strips(left, claim, *values)
        learners = [name for name in LOOKS if any(name in arm.split() for arm in values[0])]
        _not_risen(right, found.summaries, here, base, learners)
        left.set_title(
            f"{cell['claim']}: {cell['outcome']}; was: {cell['base']}", fontsize="medium"
        )
        right.set_title(f"{named(cell['variant'])} (pale: without it)", fontsize="medium")
    listed = ", ".join(f"{row.claim} by {named(row.variant)}" for row in cells.itertuples())
    return marked(headed(figure, f"The clearest changes of a verdict: {listed}"), found.mark)


def named(row: str) -> str:
    """The name of a row of the map, with symbols."""
    for word, symbol in SYMBOLS.items():
        row = row.replace(word, symbol)
    return row


def _surest(judged: pd.DataFrame) -> pd.DataFrame:
    """The whole table, and the rows with the changes that chance explains least."""
    changed = judged[judged.changes.astype(bool)].sort_values("p", kind="stable")
    kept = [WHOLE, *changed.variant.unique()[: FEW_ROWS - 1]]
    return judged[judged.variant.isin(kept)]


def _heights(letters: list[str]) -> list[float]:
    """Where each row of the map lies, with some room between departures."""
    steps = [1.0 + 0.4 * (one != other) for one, other in pairwise(letters)]
    result: list[float] = np.cumsum([0.0, *steps]).tolist()
    return result


def _folded(text: str, most: int) -> str:
    """A text on lines of so many characters, if its words let it."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if len(in_words(longer)) <= most:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(filter(None, lines))


def _cell(axes: Axes, column: int, y: float, cell: Mapping[str, Any]) -> None:
    """Colour, word and share of yes; framed, and with what it was before, if it changes."""
    fill, ink = FILLS[cell["outcome"]]
    place, size = (column + 0.03, y - 0.46), (0.94, 0.92)
    axes.add_patch(Rectangle(place, *size, facecolor=fill, edgecolor="0.5", linewidth=0.5))
    text = WORDS[cell["outcome"]]
    if cell["changes"]:
        text = f"→ {text}" if sheet().narrow else f"{WORDS[cell['base']]} → {text}"
        axes.add_patch(Rectangle(place, *size, fill=False, edgecolor="black", linewidth=1.8))
    elif 0 < cell["share"] < 1:
        text += f" {cell['share']:.0%}"
    axes.text(column + 0.5, y, text, ha="center", va="center", color=ink, fontsize="small")


def _changed(judged: pd.DataFrame) -> str:
    """How many verdicts change, of which claim most do, and of which none does."""
    decided = judged[(judged.variant != WHOLE) & (judged.outcome != UNDECIDABLE)]
    decided = decided[decided.base != UNDECIDABLE]
    changes = decided.groupby("claim", sort=False).changes.sum()
    never = [str(claim) for claim, count in changes.items() if not count]
    steady = f"; those on {' and '.join(never)} never" if never and changes.any() else ""
    count = f"{int(changes.sum())} of {len(decided)} decided verdicts change"
    if not changes.any():
        return count
    return f"{count}, {changes.max()} of them on {changes.idxmax()}{steady}"


def _strips(axes: Axes, claim: RunClaim, here: Values, base: Values) -> None:
    """The measure of each run, arm by arm: hollow for the baseline, filled for the variant."""
    low, high = _finite_range(pd.concat([here, base]), claim.threshold)
    for i, arm in enumerate(here):
        look = LOOKS[arm.split()[-1]]
        for shift, values, face in ((-0.2, base, "none"), (0.2, here, look.color)):
            numbers = values[arm].dropna().clip(low, high)
            x = i + shift + np.linspace(-0.12, 0.12, len(numbers))
            style: dict[str, Any] = {
                "color": look.color,
                "markerfacecolor": face,
                "markersize": 4,
            }
            axes.plot(x, numbers, look.marker, linestyle="", **style)
    axes.axhline(claim.threshold, **LIMIT)
    if claim.linear_to:
        axes.set_yscale("symlog", linthresh=claim.linear_to)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        axes.set_yscale("log")
        plain(axes.yaxis)
    axes.set_xticks(range(len(here.columns)), list(here))
    axes.set_ylabel(claim.label, fontsize="small")


def _not_risen(
    axes: Axes,
    summaries: Mapping[Experiment, Outline],
    here: pd.DataFrame,
    base: pd.DataFrame,
    learners: Iterable[str],
) -> None:
    """The share of runs without a rise of the noise-free cost, here and, pale, in the baseline."""
    for name in learners:
        for runs, own in ((base, {"alpha": 0.35}), (here, {"label": name})):
            episode, costs = _curves(summaries, runs[runs.learner == name])
            axes.plot(episode, (costs <= RISEN).mean(axis=0), **LOOKS[name].line, **own)
    axes.set(ylabel="share not risen", ylim=(-0.03, 1.03))
    over_episodes(axes)
    axes.legend(fontsize="small", frameon=True, framealpha=0.9, edgecolor="none")  # on the lines


def _curves(summaries: Mapping[Experiment, Outline], runs: pd.DataFrame) -> tuple[Vector, Matrix]:
    """After which episodes, and the noise-free costs over theta_init's, shape (runs, rollouts).

    What a run did not reach costs infinitely much.
    """
    judged = [summaries[experiment_of(row)].evaluations for row in runs.to_dict("records")]
    episode = max((one["episode"] for one in judged), key=len)
    costs = np.full((len(judged), len(episode)), np.inf)
    for row, one in zip(costs, judged, strict=True):
        row[: len(one["cost"])] = one["cost"] / one["cost"][0]
    return episode, costs


def _finite_range(values: Values, border: float) -> tuple[float, float]:
    """What stands for minus infinity and for infinity among these."""
    numbers = values.to_numpy().ravel()
    finite = np.append(numbers[np.isfinite(numbers)], border)
    return finite.min() - 0.5 * abs(finite.min()), finite.max() + 0.5 * abs(finite.max())
