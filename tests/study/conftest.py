"""A benchmark that nobody measured, with round numbers."""

import copy

import pytest

LOOPS = ("without noise", "with noise")
SOLVERS = {"riccati": 40e-6, "fatrop": 0.8e-3, "ipopt": 2e-3, "ipopt MX": 4e-3, "rebuilt": 40e-3}
SOLVES = {"ES": 2.0, "GES": 2.0, "RDES": 1.0, "DES": 1.0}
FIT = 0.2  # [ms]
REST = 0.02  # [ms]
HOURS = {"ES": 18.0, "GES": 18.0, "RDES": 9.0}


def transposed(names: tuple[str, ...], rows: list[tuple]) -> dict[str, list]:
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def learner(solver: str, name: str) -> tuple:
    solve, fit = 1e3 * SOLVERS[solver], FIT if name in ("RDES", "DES") else None
    step = SOLVES[name] * solve + (fit or 0.0) + REST
    hours = step * 39 / 3600
    return solver, name, SOLVES[name], step, solve, fit, REST, hours, HOURS.get(name)


def growing(varied: str, sizes: tuple[int, ...], each: float) -> list[tuple]:
    return [(varied, size, 4 * (4e-6 + each * size), 4) for size in sizes for _ in range(3)]


@pytest.fixture
def measured() -> dict[str, dict]:
    """Every figure is reached, and everything is exactly linear; a test may change its copy."""
    return copy.deepcopy(MEASURED)


MEASURED = {
    "about": {"length": "full", "key": "0", "date": "2026-01-01", "seconds": 60.0, "others": 0.1},
    "solves": transposed(
        ("loop", "solver", "warm", "seconds", "iterations", "excess"),
        [
            (loop, solver, t > 0, seconds if t else 10 * seconds, 5, 0.0)
            for loop in LOOPS
            for solver, seconds in SOLVERS.items()
            for t in range(5)
        ],
    ),
    "loop": transposed(("loop", "seconds"), [(loop, 40e-6) for loop in LOOPS for _ in range(5)]),
    "parts": {"part": ["solve, compiled part", "step of the plant"], "seconds": [30e-6, 2e-6]},
    "growth": transposed(
        ("varied", "size", "seconds", "iterations"),
        growing("horizon", (5, 10, 20, 40, 80), 0.5e-6)
        + growing("obstacles", (1, 4, 8, 16, 32), 0.25e-6),
    ),
    "learners": transposed(
        (
            "solver",
            "learner",
            "solves",
            "ms_per_step",
            "ms_per_solve",
            "ms_per_fit",
            "ms_per_rest",
            "hours",
            "hours_paper",
        ),
        [learner(solver, name) for solver in ("riccati", "fatrop", "ipopt") for name in SOLVES],
    ),
    "rival": {"learner": ["mpcrl", "mpcrl", "ES", "ES"], "seconds": [0.01, 0.01, 1e-4, 1e-4]},
    "runs": {
        "learner": list(SOLVES),
        "episodes": [300] * 4,
        "seconds": [4.0, 4.0, 16.0, 16.0],
        "processor": [4.0, 4.0, 16.0, 16.0],
    },
    "episodes": transposed(
        ("learner", "episode", "seconds", "memory"),
        [(name, k, 0.01 * k, 400_000_000) for name in SOLVES for k in range(1, 301)],
    ),
    "parallel": {"workers": [1, 2], "seconds": [20.0, 10.5], "runs": [4, 4], "episodes": [9, 9]},
    "first": {
        "cached": [False, True, True],
        "solve": [30.0, 0.6, 0.8],
        "step": [1.0, 0.1, 0.1],
        "process": [33.0, 2.0, 2.0],
        "notice": [True, False, False],
    },
}
