"""What is measured in a process of its own: `python -m nmpcrl.bench.fresh_process run ES 30`.

Prints one JSON object.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import psutil

from nmpcrl.bench import problem_sizes
from nmpcrl.bench.learners import time_learners
from nmpcrl.bench.solves import Columns, columns_of
from nmpcrl.study import Experiment, paper, run


def whole_run(learner: str, episodes: str) -> dict[str, Any]:
    """A run of `experiment.run`: seconds and memory after each episode, and the seconds of all.

    What the processor spent on it falls short of the wall time where others were waiting for it.
    """
    process = psutil.Process()
    seconds: list[float] = []
    memory: list[int] = []  # resident [bytes]

    def on_episode(*_: Any) -> None:
        seconds.append(time.perf_counter() - began)
        memory.append(process.memory_info().rss)

    began, processor = time.perf_counter(), time.process_time()
    run(Experiment(learner=learner, episodes=int(episodes)), on_episode)
    return {
        "total": time.perf_counter() - began,
        "processor": time.process_time() - processor,
        "seconds": seconds,
        "memory": memory,
    }


def first_call() -> dict[str, float]:
    """Seconds of the first solve, and of the first step of plant and cost after it."""
    nmpc, theta = paper.nmpc(), np.array(paper.THETA_INIT)
    began = time.perf_counter()
    action = nmpc.solve(nmpc.task.start, theta).action
    solved = time.perf_counter()
    nmpc.plant.step(nmpc.task.start, action)
    nmpc.task.stage_cost(nmpc.task.start, action)
    return {"solve": solved - began, "step": time.perf_counter() - solved}


def learning_steps(steps: str) -> Columns:
    """The columns of `time_learners`; None where there is no number."""
    return columns_of(time_learners(steps=int(steps)))


def problem_of_sizes(*sizes: str) -> dict[str, float]:
    """The times of `problem_sizes.measured`."""
    return problem_sizes.measured(problem_sizes.Sizes(*map(int, sizes)))


MEASURES: dict[str, Callable[..., Any]] = {
    "run": whole_run,
    "first": first_call,
    "steps": learning_steps,
    "sizes": problem_of_sizes,
}

if __name__ == "__main__":
    name, *arguments = sys.argv[1:]
    print(json.dumps(MEASURES[name](*arguments)))
