"""Registers `nmpcrl/Robot-v0` with Gymnasium when it is imported.

`gymnasium.make("nmpcrl.gym:nmpcrl/Robot-v0")` imports it as well. The module belongs to no room,
because `report` draws an environment of `study`.
"""

from typing import Any

from gymnasium import Env, register

from nmpcrl import Matrix


def robot(layout: Any = None, **options: Any) -> Env[Any, Any]:
    """A `RobotEnv` with frames."""
    from nmpcrl.study.robot import RobotEnv

    return RobotEnv(layout, draw=_draw, **options)


def _draw(task: Any, states: Matrix) -> Any:
    from nmpcrl.report.figures.robot import frame  # imports matplotlib

    return frame(task, states)


register("nmpcrl/Robot-v0", entry_point="nmpcrl.gym:robot")
