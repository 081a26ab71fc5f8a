"""The course: exercises, the checks of their answers, and the notebooks that hold them."""

from nmpcrl.course.answers import choice, formula, number
from nmpcrl.course.behaviour import behaves, function, holds
from nmpcrl.course.outcome import Outcome, Unsolved, exercise, varied

__all__ = [
    "Outcome",
    "Unsolved",
    "behaves",
    "choice",
    "exercise",
    "formula",
    "function",
    "holds",
    "number",
    "varied",
]
