"""What is worked out once for an object, and forgotten with it."""

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

Of = TypeVar("Of")
Result = TypeVar("Result")


def remembered(function: Callable[[Of], Result]) -> Callable[[Of], Result]:
    """`functools.cache` for a function of one object, which it does not keep alive."""
    known: WeakKeyDictionary[Any, Result] = WeakKeyDictionary()

    @wraps(function)
    def again(of: Of) -> Result:
        if of not in known:
            known[of] = function(of)
        return known[of]

    vars(again)["cache_info"] = lambda: f"{len(known)} remembered"
    return again
