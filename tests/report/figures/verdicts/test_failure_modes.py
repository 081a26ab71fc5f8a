"""Why runs fail: bars are counts."""

from nmpcrl.report.figures.verdicts import failure_modes
from nmpcrl.study import Experiment


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
    assert figure.get_suptitle() == "32 of 80 runs failed: 16 overshoot, 16 none of these"
    signs, ends = (widths(axis) for axis in figure.axes)
    learners = [tick.get_text() for tick in figure.axes[0].get_yticklabels()]
    assert learners == ["ES", "DES", "RDES", "GES", "TDC"]
    assert (signs[1, 0], signs[2, 4], signs[0, 5]) == (16, 16, 16)
    assert (ends[2, 0], ends[2, 5]) == (4, 12)  # stopped in training, arrived
    for parts in (signs, ends):
        for row in range(len(learners)):
            assert sum(parts[row, part] for part in range(6)) == 16
    assert source_of(figure) == found.mark
