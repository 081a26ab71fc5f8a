"""All that the published files come to is what it was when it was frozen, to the last digit."""

import freeze
import pytest
from plain_values import differing, processor

TOLERANCE = 1e-9  # of another processor than the one on which the files were written


@pytest.mark.parametrize("file", [name for name in freeze.FILES if name != "machine"])
def test_what_is_published_comes_to_what_it_was_frozen_as(file):
    same = freeze.frozen("machine")["abilities"] == processor()
    now, then = freeze.computed(file), freeze.frozen(file)
    lines = differing(now, then, 0.0 if same else TOLERANCE)
    assert not lines, "\n".join(
        ["only new published data may change these; see freeze.py", *lines[:30]]
    )


def test_a_last_digit_a_missing_entry_and_another_type_are_noticed():
    then = {"a": [1, 0.1], "b": {"c": True}, "d": None}
    assert differing({"a": [1, 0.1], "b": {"c": True}, "d": None}, then) == []
    now = {"a": [1.0, 0.1 + 1e-16 + 1e-17], "b": {"c": 1}, "e": None}
    assert [line.partition(":")[0] for line in differing(now, then)] == [
        "/a[0]", "/a[1]", "/b/c", "/e", "/d",
    ]  # fmt: skip
    assert differing([0.1], [0.1 + 1e-15], tolerance=1e-9) == []
    assert differing([1, 2], [1, 2, 3]) != []
