"""Errors whose message is one sentence, which IPython shows without a traceback."""


class Refusal(ValueError):
    """An impossible request; the message says why."""

    def _render_traceback_(self) -> list[str]:
        """The lines that IPython, Jupyter and papermill show for a traceback."""
        return [f"{type(self).__name__}: {self}"]


class ParameterError(Refusal):
    """A value that is not allowed; the message has the parameter, the value, and allowed values."""
