"""All that the published files come to is what it was when it was frozen, to the last digit."""

import freeze
import pytest
from plain_values import differing, processor

TOLERANCE = 1e-6  # of another processor than the one that wrote the files: fits end a bit elsewhere


@pytest.mark.parametrize("file", [name for name in freeze.FILES if name != "machine"])
def test_what_is_published_comes_to_what_it_was_frozen_as(file):
    same = freeze.frozen("machine")["abilities"] == processor()
    now, then = freeze.computed(file), freeze.frozen(file)
    lines = differing(now, then, 0.0 if same else TOLERANCE)
    assert not lines, "\n".join(
        ["only new published data may change these; see freeze.py", *lines[:30]]
    )
