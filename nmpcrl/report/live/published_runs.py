"""The live figure of published runs, episode by episode.

A page is given one seed in one layout; `scripts` are the files that it loads for all others. The
trajectories are in neither: the page solves them again.
"""

import gzip
import json
from base64 import b64encode
from collections.abc import Collection
from typing import Any

import numpy as np
from IPython.display import HTML

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims import published
from nmpcrl.claims.published import FOLLOWED, Published
from nmpcrl.report.figures.style import DECAY_TITLES, LOOKS
from nmpcrl.report.live.frame import solving
from nmpcrl.report.live.problem import discs, look, problem_of, surroundings
from nmpcrl.study import paper
from nmpcrl.study.design import LAYOUTS, SEEDS
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Column

LAYOUT, SEED = LAYOUTS[0], SEEDS[0]  # what a page is given
CHOICES = ("first", "second", "layout", "decay", "seed")
FILE = "runs_{}.js"
LATER = "window.nmpcrl.packed = {{ ...window.nmpcrl.packed, {}: {} }};\n"


def runs(*learners: str) -> HTML:
    """Published runs beside the baseline without learning; the first two learners are shown."""
    nmpc, known = paper.nmpc(LAYOUT), published.load()
    tasks = {name: paper.task(name) for name in LAYOUTS}
    data = {
        "looks": {name: look(name) for name in (*learners, "frozen")},
        "chosen": dict(zip(CHOICES, (*learners[:2], LAYOUT, "step", SEED), strict=True)),
        "layouts": {name: discs(task) for name, task in tasks.items()},
        "decays": list(DECAY_TITLES),
        "seeds": SEEDS,
        "episodes": _episodes(known),
        "names": paper.THETA_NAMES,
        "given": packed(known, LAYOUT, SEED, (*learners, "frozen")),
        "start": nmpc.task.start.tolist(),
        "horizon": nmpc.horizon,
        "steps": paper.STEPS,
        "problem": problem_of(nmpc),
        **surroundings(*tasks.values()),
    }
    return solving("runs", nmpc, data)


def scripts() -> dict[str, str]:
    """The files with all runs of a layout, by their names."""
    known = published.load()
    return {
        FILE.format(layout): LATER.format(layout, json.dumps(packed(known, layout=layout)))
        for layout in LAYOUTS
    }


def packed(
    known: Published, layout: str, seed: int | None = None, learners: Collection[str] = tuple(LOOKS)
) -> dict[str, Any]:
    """Some runs as JSON takes them.

    Returns:
        The name of each run, and of all runs in turn the training cost by episode, the cost without
        noise by evaluation, and each component of theta by episode, the 0th included: the
        `byte_planes` of them, compressed, in base 64.
    """
    chosen = {
        _name(e): _numbers(summary, _episodes(known))
        for e, summary in known.summaries.items()
        if known.variants[e] in FOLLOWED and e.layout == layout and e.learner in learners
        and seed in (None, e.seed)
    }  # fmt: skip
    planes = byte_planes(list(chosen.values())).tobytes()
    numbers = b64encode(gzip.compress(planes, mtime=0)).decode()
    return {"runs": list(chosen), "numbers": numbers}


def byte_planes(numbers: list[Column]) -> Column:
    """Single precision as differences of bits, the lowest bytes of all first; shape (4, count)."""
    bits = np.ravel(numbers).astype("<f4").view("<u4")
    steps = np.diff(bits, prepend=np.uint32(0))
    return np.ascontiguousarray(steps.view(np.uint8).reshape(-1, 4).T)


def _name(e: Experiment) -> str:
    return f"{e.learner} {e.decay} {e.seed}"


def _numbers(summary: RunSummary, evaluated: list[int]) -> Column:
    """One row; nan where a run was stopped before."""
    found, training = summary.evaluations, summary.episodes["cost"]
    judged = np.full(len(evaluated), np.nan)
    judged[: len(found["cost"])] = found["cost"]
    theta = np.full((1 + len(training), len(paper.THETA_INIT)), np.nan)
    theta[1:] = summary.episodes["theta"]
    theta[found["episode"]] = found["theta"]
    return np.concatenate([training, judged, theta.T.ravel()])


def _episodes(known: Published) -> list[int]:
    """After which episodes a run that was not stopped was judged."""
    after = known.summaries[Experiment("frozen")].evaluations["episode"]
    return [int(episode) for episode in after]
