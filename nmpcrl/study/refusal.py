"""What cannot be done is refused in one sentence, without a traceback where IPython shows it."""


class Refusal(ValueError):
    """What was asked for cannot be done; the message is one sentence that says why."""

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in the place of a traceback, and so Jupyter and papermill."""
        return [f"{type(self).__name__}: {self}"]


class ParameterError(Refusal):
    """A parameter is not what it may be; the message names it, its value and what is allowed."""
