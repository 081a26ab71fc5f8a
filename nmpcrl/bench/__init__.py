"""How long a step takes, here and with other libraries: measured, stored, compared with targets.

`sweep` counts how the solves of very many drawn problems end.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nmpcrl.bench.suite import LENGTHS, OTHERS, STEPS, beforehand, read_or_measure
else:

    def __getattr__(name: str) -> Any:
        """The suite on demand: the workers of a sweep need none of its imports."""
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module("nmpcrl.bench.suite"), name)


__all__ = ["LENGTHS", "OTHERS", "STEPS", "beforehand", "read_or_measure"]
