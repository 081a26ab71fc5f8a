"""The course: exercises, the checks of their answers, and points for what students hand in."""

from nmpcrl.course.answers import choice, number
from nmpcrl.course.behaviour import behaves, function, holds
from nmpcrl.course.outcome import Outcome, Unsolved

__all__ = ["Outcome", "Unsolved", "behaves", "choice", "function", "holds", "number"]
