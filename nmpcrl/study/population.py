"""The population of layouts: 60 to tune on and 120 to judge on, fixed before anything is trained.

They are the first that a seeded sampler drew and the screening of `layouts` accepted, in the order
of the draws and without regard to their kind; none is a named one. Whatever is chosen (a step size,
a threshold of a predictor) is chosen on `TUNE`, and judged on `JUDGE`.
"""

import json
from collections.abc import Iterator
from pathlib import Path

from nmpcrl.study import paper
from nmpcrl.study.layouts import Centres, sampler, screen
from nmpcrl.study.storage.atomic import write_json

SEED = 24  # of the sampler; the named layouts come from another
SIZES = {"T": 60, "J": 120}  # how many layouts begin with the letter: to tune on, to judge on
PLACE = Path(__file__).with_name("population.json")


def drawn() -> Iterator[Centres]:
    """The layouts in the order of the draws, without end; each is screened, which takes 0.2 s."""
    known = set(paper.LAYOUTS.values())
    for centres in sampler(SEED):
        if centres not in known and screen(centres).passed:
            known.add(centres)
            yield centres


def names() -> tuple[str, ...]:
    """What the layouts are called, in the order of the draws: T01 to T60, J001 to J120."""
    return tuple(
        f"{letter}{i:0{len(str(n))}}" for letter, n in SIZES.items() for i in range(1, n + 1)
    )


def write() -> Path:
    """Draw the layouts again, and keep them with the package."""
    write_json(PLACE, dict(zip(names(), drawn(), strict=False)))
    return PLACE


def load() -> dict[str, Centres]:
    """The layouts that `write` kept, by name."""
    kept = json.loads(PLACE.read_text("utf-8"))
    return {name: tuple((x, y) for x, y in centres) for name, centres in kept.items()}


LAYOUTS = load()
TUNE = {name: centres for name, centres in LAYOUTS.items() if name[0] == "T"}
JUDGE = {name: centres for name, centres in LAYOUTS.items() if name[0] == "J"}
