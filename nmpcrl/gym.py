"""Registers `nmpcrl/Robot-v0` with Gymnasium when it is imported.

`gymnasium.make("nmpcrl.gym:nmpcrl/Robot-v0")` imports it as well. The module belongs to no room,
because `report` draws an environment of `study`.
"""

from typing import Any

import numpy as np
from gymnasium import register

from nmpcrl.study.robot import RobotEnv


class Robot(RobotEnv):
    """A `RobotEnv` with frames."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012

    def __init__(
        self, layout: Any = None, *, render_mode: str | None = None, **options: Any
    ) -> None:
        """Take the arguments of `RobotEnv`, and None or "rgb_array" as `render_mode`."""
        super().__init__(layout, **options)
        self.render_mode = render_mode

    def render(self) -> Any:
        """The layout and the path so far, shape (640, 640, 3); None without a render mode."""
        if self.render_mode is None:
            return None
        from nmpcrl.report.figures.robot import frame  # imports matplotlib

        return frame(self.task, np.array(self.states or [self.task.start]))


register("nmpcrl/Robot-v0", entry_point="nmpcrl.gym:Robot")
