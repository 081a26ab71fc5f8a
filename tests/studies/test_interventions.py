"""Which runs of RDES are made again with one thing taken away, and how their ends are counted."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.claims import published
from nmpcrl.studies import interventions, population
from nmpcrl.studies.interventions import ARMS, INTERVENTIONS


def test_all_stopped_runs_are_made_again_nudged_ones_beside_theta_init_and_paired(monkeypatch):
    six, drawn = (INTERVENTIONS.parts[part].order("nudged") for part in ("six", "drawn"))
    halves = published.load().verdict("C1").halves
    (stopped,) = (one.counts[1] for one in halves
                  if (one.wrong, one.decay) == ("had to be stopped", "episode"))  # fmt: skip
    count, _ = population.early_overshoot(population.load().main).beside["runs stopped"]
    assert (len({*six}), len({*drawn})) == (len(six), len(drawn)) == (stopped, count)
    assert len({place for place, _ in drawn[:50]}) == 50
    watched = []

    def watch(experiment, intervention):
        watched.append((experiment.layout, experiment.seed, experiment.theta[0], intervention))
        return Outcome(True, 2, *[np.array([1.0, 2.0])] * 3)

    monkeypatch.setattr(interventions, "watch", watch)
    rows = [interventions.again(setting, "D", 300, 3) for setting in ARMS.values()]
    assert rows == [{"episodes": 1}] * 3
    assert watched[:2] == [("D", 3, 1.0, "theta held"), ("D", 3, 1.0, "true slope")]
    assert watched[2] == ("D", 3, pytest.approx(1 + 1e-9, abs=1e-12), "none")
    ends = {("A", 0): (300, 20), ("A", 1): (300, 299), ("B", 0): (10, 5)}
    rows = [{"part": "six", "arm": arm, "place": place, "k": k, "episodes": one}
            for (place, k), both in ends.items()
            for arm, one in zip(("true slope", "nudged"), both, strict=True)]  # fmt: skip
    runs = interventions.ends(pd.DataFrame(rows))
    assert runs.groupby("intervention").stopped.sum().to_dict() == {
        "none": 3, "nudged": 3, "true slope": 1,
    }  # fmt: skip
    assert interventions.survival(runs, "true slope").counts == {"survive, true slope": (2, 3)}
    found = interventions.live(runs, "true slope")
    assert (found.value, found.low, found.high) == (pytest.approx(2 / 3), 0, 1)
    assert interventions.live(runs, "nudged").value == 0
    assert interventions.live(runs, "true slope", "nudged").value == found.value
