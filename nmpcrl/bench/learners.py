"""How long a learning step takes: our learners with each solver, and mpcrl's beside ours."""

import time

from nmpcrl.bench import timing
from nmpcrl.bench.solves import Columns

TURN = 20  # steps that a learner takes at a time: then the caches hold what its own loop leaves


def learners(steps: int) -> Columns:
    """Table II with every solver: the columns of `time_learners`; None where there is no number."""
    table = timing.time_learners(steps=steps, turn=TURN).astype(object)
    return table.where(table.notna(), None).to_dict("list")


def against_mpcrl(rounds: int, steps: int) -> Columns:
    """ES and mpcrl's Q-learning in turn, an episode's first steps each; seconds of every step.

    Returns:
        A row a round and learner: learner ("ES" or "mpcrl"), seconds. No rows without mpcrl.
    """
    columns: Columns = {"learner": [], "seconds": []}
    try:
        from nmpcrl.bench.baseline_mpcrl import time_mpcrl
    except ImportError:
        return columns
    for _ in range(rounds):
        for learner, times in (("mpcrl", time_mpcrl(steps)), ("ES", _time_es(steps))):
            columns["learner"] += [learner] * len(times)
            columns["seconds"] += times
    return columns


def _time_es(steps: int, episodes: int = 5) -> list[float]:
    """Seconds of as many first steps of some episodes of ES, each with noise of its own."""
    times = []
    for seed in range(episodes):
        learning = timing.learn("ES", seed=seed)
        next(learning)  # the first call loads the solver
        for _ in range(steps):
            began = time.perf_counter()
            next(learning)
            times.append(time.perf_counter() - began)
    return times
