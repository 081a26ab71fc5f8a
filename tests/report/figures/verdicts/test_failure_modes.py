"""Why runs went wrong: bars are counts, and the traced runs are those that were given."""

import numpy as np
import pytest

from nmpcrl.claims.failure_modes import OVER_PREDICTED, rise
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.verdicts import failure_modes
from nmpcrl.study import Experiment
from nmpcrl.study.experiment import frozen_arm


def unlike(experiment: Experiment) -> dict:
    """DES overshoots and ends at a higher cost; RDES does, for no reason known, or was stopped."""
    changes = {
        "DES": {"end": 1.2, "alpha_phi2": 3.0},
        "RDES": {"end": 1.2} if experiment.seed else {"reached": 40},
    }
    return changes.get(experiment.learner, {})


def widths(axis) -> dict[tuple[int, int], float]:
    """How long the parts of the bars are: by learner, then by part."""
    learners = len(axis.get_yticks())
    bars = [patch.get_width() for patch in axis.patches]
    return {(i % learners, i // learners): width for i, width in enumerate(bars)}


def test_bars_count_the_runs_of_each_learner_by_mechanism_and_by_ending(made_up, source_of):
    found = made_up(unlike)
    figure = failure_modes.reasons(found)
    assert figure.get_suptitle() == "32 of 80 runs went wrong: 16 overshoot, 16 none of these"
    signs, ends = (widths(axis) for axis in figure.axes)
    learners = [tick.get_text() for tick in figure.axes[0].get_yticklabels()]
    assert learners == ["ES", "DES", "RDES", "GES", "TDC"]
    assert (signs[1, 0], signs[2, 4], signs[0, 5]) == (16, 16, 16)
    assert (ends[2, 0], ends[2, 5]) == (4, 12)  # stopped in training, arrived
    for parts in (signs, ends):
        for row in range(len(learners)):
            assert sum(parts[row, part] for part in range(6)) == 16
    assert source_of(figure) == found.mark


def test_a_study_in_which_all_went_well_says_so(made_up):
    assert failure_modes.reasons(made_up()).get_suptitle() == "0 of 80 runs went wrong"
    assert failure_modes.traced({}, {}).get_suptitle() == "No run went wrong"


def test_every_example_has_a_column_with_its_thresholds_and_the_rise_in_grey(made_up):
    found = made_up(unlike)
    names = {"overshoot": Experiment("DES"), "none of these": Experiment("RDES", seed=1)}
    examples = {name: found.summaries[e] for name, e in names.items()}
    rollouts = {name: found.summaries[frozen_arm(e)].states for name, e in names.items()}
    figure = failure_modes.traced(examples, rollouts)
    columns = np.array(figure.axes).reshape(4, 2)
    assert figure.get_suptitle() == "One run of each kind: overshoot, none of these"
    assert [axis.get_title(loc="left").split("\n")[0] for axis in columns[0]] == list(names)
    for column, run in zip(columns.T, examples.values(), strict=True):
        levels = [axis.get_lines()[-1].get_ydata()[0] for axis in column[:3]]
        assert levels == [1.0, OVERSHOOT, OVER_PREDICTED]
        window = rise(run)
        for axis in column:
            (grey,) = axis.patches
            assert (grey.get_x(), grey.get_x() + grey.get_width()) == (window.start, window.stop)
    step = columns[1, 0].get_lines()[0].get_ydata()
    assert step == pytest.approx(3.0)
    assert columns[0, 0].get_lines()[0].get_ydata().max() == pytest.approx(1.2)
