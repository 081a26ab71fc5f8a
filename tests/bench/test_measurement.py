"""When the timing table is read and when it is measured, and what the command prints."""

import pandas as pd
import pytest

from nmpcrl.bench import measurement
from nmpcrl.study.files import folder


@pytest.fixture
def waited():
    """The share of the time that learning steps wait for a processor, when they are measured."""
    return [0.0]


@pytest.fixture
def counted(tmp_path, monkeypatch, waited, timings):
    """The lengths that were measured, in a folder of their own; measuring takes no time."""
    lengths = []

    def time_learners(processes, steps):
        known = {one: name for name, one in measurement.LENGTHS.items()}
        lengths.append(known[processes, steps])
        return timings.assign(waited=waited[0])

    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setattr(measurement, "time_learners_afresh", time_learners)
    monkeypatch.setattr(measurement.psutil, "cpu_percent", lambda _: 25.0)  # watches for a second
    return lengths


def test_what_was_measured_is_read_again(counted, timings):
    first, again = (measurement.read_or_measure("short") for _ in range(2))
    assert counted == ["short"]
    for one in (first, again):
        pd.testing.assert_frame_equal(one.timings, timings)
    assert again.others == 0.25
    assert again.machine.keys() == {"processor", "architecture", "cores", "system"}
    assert list(folder().iterdir()) == [measurement.path()]


CHANGES = [(measurement, "machine"), (measurement.provenance, "environment")]
CHANGES += [(measurement.lock, name) for name in ("sources_hash", "code")]


@pytest.mark.parametrize(
    ("kept", "asked", "change", "again"),
    [
        ("full", "short", (), False),  # a longer measurement serves for a shorter one
        ("short", "smoke", (), False),
        ("smoke", "short", (), True),
        *(("short", "short", change, True) for change in CHANGES),
    ],
)
def test_a_shorter_measurement_another_machine_version_or_source_measures_again(
    counted, monkeypatch, kept, asked, change, again
):
    measurement.read_or_measure(kept)
    if change:
        monkeypatch.setattr(*change, lambda *_: {"numba": "other"})
    found = measurement.read_or_measure(asked)
    assert counted == ([kept, asked] if again else [kept])
    assert found.length == (asked if again else kept)


@pytest.mark.parametrize("content", ["{", "[]", "{}", '{"timings": 1}'])
def test_a_damaged_file_is_told_and_measured_again(counted, capsys, content):
    measurement.read_or_measure("short")
    measurement.path().write_text(content)
    measurement.read_or_measure("short")
    assert counted == ["short", "short"]
    assert "is damaged" in capsys.readouterr().err


def test_what_was_timed_on_a_busy_machine_is_timed_again_where_calm_is_asked_for(counted, waited):
    waited[0] = 0.5
    measurement.read_or_measure("short")
    measurement.read_or_measure("short")
    assert counted == ["short"]
    waited[0] = 0.0
    (call,) = measurement.beforehand("short")
    call()
    call()
    assert counted == ["short", "short"]
