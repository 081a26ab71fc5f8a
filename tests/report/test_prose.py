"""Numbers in prose, the braces of LaTeX, and source that is shown from the library."""

import inspect
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.learning import updates
from nmpcrl.report import prose
from nmpcrl.report.cited import Count, by_reading
from nmpcrl.report.prose import filled, listing, say, source

WORDS = st.text("abc XYZ.,;:$=-+*|\\^_", max_size=12)


def test_the_cost_of_a_run_that_failed_is_written_as_infinite():
    assert filled("{a:.1%}, {b:.2f}, {c}", a=np.inf, b=-np.inf, c="an inf") == "∞, -∞, an inf"


@pytest.mark.parametrize(("when", "said"), [(True, "It fell by 3 %."), (False, prose.ELSEWHERE)])
def test_of_other_runs_one_line_stands_in_the_place_of_an_interpretation(when, said, monkeypatch):
    shown = []
    monkeypatch.setattr(prose, "_show", shown.append)
    say("It fell by {fall} %.", when=when, fall=3)
    assert shown == [said]


@given(before=WORDS, after=WORDS, number=st.floats(allow_nan=False, allow_infinity=False))
def test_what_stands_around_a_number_is_kept(before, after, number):
    template = f"a{before} {{number:.3e}}{after}z"
    assert filled(template, number=number) == f"a{before} {number:.3e}{after}z"


@pytest.mark.parametrize(
    ("template", "numbers", "said"),
    [
        ("it costs {cost:.2f}", {}, r"no number is given for \{cost\} in: it costs"),
        (
            "it costs nothing",
            {"cost": 3.0},
            r"cost is given, and there is no \{cost\} in: it costs",
        ),
    ],
)
def test_a_placeholder_and_a_number_without_each_other_are_refused_by_name(template, numbers, said):
    with pytest.raises(NameError, match=said):
        filled(template, **numbers)


def test_source_is_the_very_text_of_the_library_of_what_is_compiled_too(monkeypatch):
    displayed = []
    monkeypatch.setattr(prose, "display", displayed.append)
    source(updates.td_error)
    (text,) = (markdown.data for markdown in displayed)
    assert text.startswith("`nmpcrl/learning/updates.py`\n\n```python\ndef td_error(")
    assert inspect.getsource(updates.td_error).strip() in text
    assert "\n@inlined\ndef centre(task, " in listing("nmpcrl.control.solvers.kernel:centre")
    with pytest.raises(NameError, match="center"):
        listing("nmpcrl.control.solvers.kernel:center")


def test_a_number_with_an_origin_carries_its_value_its_interval_and_what_it_is_of():
    shown = filled("{rate:.2f}", origin="us", rate=Estimate(0.5, 0.25, 0.75))
    assert shown.startswith('<data value="0.5 [0.25, 0.75]" title="rate: us">0.50 [')
    said = filled("It cost {left:.0%} in {n}.", origin="720 runs", left=0.123, n=Count(3, 6))
    assert said == (
        'It cost <data value="0.123" title="left: 720 runs">12%</data> in'
        ' <data value="3 of 6" title="n: 720 runs">3 of 6</data>.'
    )


@pytest.mark.parametrize(
    ("form", "text"),
    [(".0%", "75% (per step) and ∞ (per episode)"), (".2f", "0.75 (per step) and ∞ (per episode)")],
)
def test_a_median_is_said_for_each_reading_of_the_decay_and_never_for_both(form, text):
    decays = ("step", "step", "episode", "episode")
    said = by_reading("share", form, (0.7, 0.8, 0.4, np.inf), decays, "4 runs")
    assert re.sub("<[^>]*>", "", said) == text
    assert re.findall('title="([^"]*)"', said) == [
        "share per step: 4 runs",
        "share per episode: 4 runs",
    ]
