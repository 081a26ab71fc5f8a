"""The runs of the population: what is trained on which of its layouts, and in what order.

A layout is the unit, so that each has noise of its own: two seeds that no other layout has. The
readings of the decay and the seeds within a layout make its answer surer, and the sample no larger.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from types import MappingProxyType
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, LAYOUTS, TUNE
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.geometry import Centres
from nmpcrl.study.learners import DECAYS

SEEDS = 2  # of each layout
SOLVING_TWICE = ("ES", "GES")  # the learners for predictors and horizons: the cheap ones
HORIZONS = (20, 40)  # beside the paper's
STEP_SIZE = 3  # times alpha, in the search for the paper's whole picture
# Numbers of the first 15 layouts to judge on of either kind; a test chooses them again.
CLOSING = (3, 4, 24, 29, 31, 32, 37, 44, 46, 50, 58, 65, 77, 82, 89)
OPEN = (1, 2, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17)
COMPARED = tuple(f"J{i:03}" for i in sorted(CLOSING + OPEN))  # with other horizons and step sizes
SOLVING = ("frozen", "ES", "GES", "TDC")  # first, so that an interruption leaves much of use
IMITATING = ("RDES", "DES")


def name_of(layout: str | Centres) -> str:
    """The name in the population of a layout as an `Experiment` holds it.

    Raises:
        KeyError: it is none of the population.
    """
    return _names()[layout]


@cache
def _names() -> dict[Any, str]:
    return {Experiment(layout=centres).layout: name for name, centres in LAYOUTS.items()}


def seeds(layout: str) -> tuple[int, ...]:
    """The seeds of a layout of the population, which no other has."""
    first = SEEDS * list(LAYOUTS).index(layout)
    return tuple(range(first, first + SEEDS))


def runs(
    learners: Sequence[str],
    layouts: Iterable[str],
    *,
    places: Sequence[int] = tuple(range(SEEDS)),
    decays: Sequence[str] = tuple(DECAYS),
    **fields: Any,
) -> tuple[Experiment, ...]:
    """Learner by learner, every layout in each reading with its own seeds.

    Args:
        learners: as `Experiment.learner`.
        layouts: names in the population.
        places: which of a layout's seeds.
        decays: the readings.
        fields: further ones of every experiment.
    """
    named = tuple(layouts)
    return tuple(
        Experiment(
            learner=learner,
            layout=LAYOUTS[name],
            decay=decay,
            seed=seed,
            **fields,
        )
        for learner in learners
        for name in named
        for decay in decays
        for seed in [seeds(name)[i] for i in places]
    )


def arms(episodes: int = paper.EPISODES) -> dict[str, tuple[Experiment, ...]]:
    """The parts of the population's study, in the order in which they are wanted.

    "judge" has the learners that solve for Q with a layout's first seed, "judge imitating" those
    that imitate it, and "judge again" all of them with the second, the longest part. "tune" has
    what predictors are fitted to. The others change one thing in the layouts that are `COMPARED`,
    with one seed, and the step size in the paper's reading only, to save time.
    """
    judged, tuned = [*JUDGE], [*TUNE]
    learning = ("frozen", *SOLVING_TWICE)
    length: dict[str, Any] = {"episodes": episodes}
    one: dict[str, Any] = {"places": (0,), **length}
    parts = {
        "judge": runs(SOLVING, judged, **one),
        "tune": runs(learning, tuned, **one),
    }
    for horizon in HORIZONS:
        parts[f"N = {horizon}"] = runs(learning, COMPARED, horizon=horizon, **one)
    parts["judge imitating"] = runs(IMITATING, judged, **one)
    larger: dict[str, Any] = {"alpha": STEP_SIZE * paper.ALPHA, "decays": ("step",)}
    parts[f"alpha x {STEP_SIZE}"] = runs(PAPER, COMPARED, **larger, **one)
    parts["judge again"] = runs((*SOLVING, *IMITATING), judged, places=(1,), **length)
    return parts


@cache
def whole_population(episodes: int = paper.EPISODES) -> Mapping[Experiment, str]:
    """Every run with the part that it belongs to; each has its frozen arm among them."""
    named: dict[Experiment, str] = {}
    for part, experiments in arms(episodes).items():
        for experiment in experiments:
            named.setdefault(experiment.canonical, part)
    return MappingProxyType(named)
