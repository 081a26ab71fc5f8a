"""Registers `nmpcrl/Robot-v0` and `nmpcrl/Tune-v0` with Gymnasium when it is imported.

`gymnasium.make("nmpcrl.gym:nmpcrl/Robot-v0")` imports it, too. It stands above the rooms, since an
environment of `study` is drawn by `report`.
"""

from typing import Any

from gymnasium import Env, register

from nmpcrl import Matrix

ROBOT, TUNE = "nmpcrl/Robot-v0", "nmpcrl/Tune-v0"


def robot(layout: Any = None, **options: Any) -> Env[Any, Any]:
    """`RobotEnv`, which can draw itself."""
    from nmpcrl.study.robot import RobotEnv

    return RobotEnv(layout, draw=_draw, **options)


def tune(layout: Any = None, **options: Any) -> Env[Any, Any]:
    """`TuneEnv`."""
    from nmpcrl.analysis.tune_env import TuneEnv

    return TuneEnv(layout, **options)


def _draw(task: Any, states: Matrix) -> Any:
    from nmpcrl.report.figures.robot import frame  # and matplotlib: only where something is drawn

    return frame(task, states)


register(ROBOT, entry_point="nmpcrl.gym:robot")
register(TUNE, entry_point="nmpcrl.gym:tune")
