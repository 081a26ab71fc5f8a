"""What is asked of the remedies is complete."""

from nmpcrl.analysis.suite import ENTRIES, LAYOUTS
from nmpcrl.claims.remedy_questions import (
    ADVICE,
    ADVISED,
    CONTROLS,
    DEAR,
    EXPECTED_FIRST,
    EXPECTED_NEVER,
    PARTS,
    RUNS_OF_TUNING,
    SETTINGS,
)
from nmpcrl.study.drawn import JUDGE, TUNE


def test_every_entry_ships_and_begins_its_tuning_as_it_ships():
    assert [*SETTINGS] == [*ENTRIES]
    for entry, settings in SETTINGS.items():
        names = [str(ENTRIES[entry].with_settings(**setting)) for setting in settings]
        assert names[:1] in ([entry], [])
        assert len({*names}) == len(names)


def test_every_entry_that_has_a_setting_has_as_many_runs_of_tuning():
    assert {len(one) for one in SETTINGS.values()} == {0, RUNS_OF_TUNING}
    free = {entry for entry, settings in SETTINGS.items() if not settings}
    assert free == {one for one in SETTINGS if not ENTRIES[one].defaults}


def test_what_is_tuned_on_is_never_judged_on():
    assert {*PARTS["tune"].layouts} <= {*TUNE}
    for part in ADVISED:
        assert {*PARTS[part].layouts} <= {*JUDGE}
    assert all({*one.layouts} <= {*LAYOUTS} for one in PARTS.values())


def test_what_is_judged_in_fewer_layouts_is_compared_at_all():
    for part in PARTS.values():
        assert {*part.fewer} <= {*SETTINGS}
        for entry in {*SETTINGS} - {*CONTROLS, *DEAR}:
            assert len(part.layouts_of(entry)) >= min(len(part.layouts), 60)
    assert PARTS["judge 50"].layouts_of("GN-J")[-1] == "J060"
    assert PARTS["judge 300"].layouts_of("guarded-RDES") == ()


def test_what_is_expected_can_come_true():
    assert {PARTS[part].budget for part in ADVISED} == {*EXPECTED_FIRST}
    assert {*EXPECTED_FIRST.values(), *EXPECTED_NEVER} <= {*SETTINGS}
    assert len({*ADVICE}) == 5
