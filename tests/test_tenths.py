"""In ten days every test runs once."""

import datetime

import tenths


def test_each_test_is_in_one_tenth_and_ten_days_run_all_of_them(monkeypatch):
    names, days, run = [f"tests/test_{k}.py::test" for k in range(300)], [], []

    class Day(datetime.date):
        @classmethod
        def today(cls):
            return cls(2026, 1, 1) + datetime.timedelta(len(days))

    monkeypatch.setattr(tenths, "date", Day)
    for _ in range(tenths.PARTS):
        days.append(tenths.asked("today"))
        chosen, others = tenths.split(names, days[-1])
        assert len(chosen) + len(others) == len(names)
        assert 15 < len(chosen) < 45
        run += chosen
    assert sorted(run) == sorted(names)
    assert sorted(days) == [*range(10)]
    assert tenths.tenth_of("tests/test_tenths.py::test") == 6
