"""What a job returns or raises comes back, or is said to be what cannot."""

import copyreg
import traceback
from functools import partial

import numpy as np
import pytest

from nmpcrl.study.storage.outcome import Unsendable, pack, unpack


class Two(Exception):
    """Pickle makes it again from one argument, which is too few."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} and {second}")


def deep(calls: int = 0) -> int:
    return deep(calls + 1)


def failing(error: Exception) -> None:
    raise error


def caused() -> None:
    try:
        failing(ArithmeticError("the cause"))
    except ArithmeticError as error:
        raise ValueError("a mistake") from error


def nested() -> list:
    inner: list = []
    for _ in range(100_000):
        inner = [inner]
    return inner


def test_a_result_comes_back_with_its_bits():
    for made in (np.linspace(0, 1, 7), 0.1 + 0.2, "text", None):
        np.testing.assert_array_equal(unpack(pack(lambda made=made: made)), made)


@pytest.mark.parametrize("job", [caused, deep], ids=["caused by another", "too deep"])
def test_an_error_comes_back_with_the_text_of_its_traceback_and_not_with_its_frames(job):
    with pytest.raises(Exception, match=r".") as here:
        job()
    with pytest.raises(type(here.value)) as there:
        unpack(pack(job))
    assert str(there.value) == str(here.value)
    told = "".join(traceback.format_exception(there.value))
    assert "outcome.py" in told
    assert ("the cause" in told) == (job is caused)


def test_an_error_is_small_however_deep_it_was_raised():
    assert len(pack(deep)) < 10_000


@pytest.mark.parametrize(
    ("job", "sentence"),
    [
        (nested, "a list, which cannot be sent: RecursionError"),
        (lambda: lambda: None, "a function, which cannot be sent: "),
        (partial(failing, Two("a", "b")), "Two: a and b, which cannot be sent: "),
    ],
    ids=["too deep", "a local function", "an error that pickle cannot make again"],
)
def test_what_cannot_be_sent_is_named(monkeypatch, job, sentence):
    monkeypatch.delitem(copyreg.dispatch_table, Two, raising=False)  # Dask can make it again
    with pytest.raises(Unsendable, match=sentence):
        unpack(pack(job))
