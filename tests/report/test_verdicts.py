"""The numbers of a verdict as sentences."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.bench.paired import Ratio
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import SMOOTH, THEOREMS
from nmpcrl.claims.verdict import PARTLY, UNDECIDABLE, Assumption, Verdict
from nmpcrl.report.verdicts import by_learner, evidence, shown

NUMBERS = {"DES_wrong": (3, 9), "RDES_wrong": (0, 9), "DES_median": np.inf, "RDES_median": 1.234}
SCOPE = {"levels": {"layout": 1, "decay": 2, "seed": 9}}
C1 = Verdict("C1", "So.", PARTLY, share=0.75, interval=(0.53, 0.89), counts={"all": (15, 20)})
C1 = replace(C1, numbers=NUMBERS, **SCOPE)
MADE = (Assumption("a", "", holds=False, by=THEOREMS), Assumption("b", "", True, by=(SMOOTH,)))
RATIO = Ratio(0.62, 0.6, 0.65, 0.5)


@pytest.mark.parametrize(
    ("verdict", "sentences"),
    [
        (
            C1,
            [
                "3 of 9 runs of DES and 0 of 9 of RDES diverged; their training cost ended at ∞ and"
                " 1.23 times",
                "It holds in 15 of 20 pairs: 75% [53%, 89%]. (1 layout, 2 readings of the decay,"
                " 9 seeds.)",
            ],
        ),
        (replace(C1, missing=3), ["[53%, 89%]; 3 pairs are missing."]),
        (
            replace(C1, share=None, interval=None, unit="runs", missing=9),
            ["No runs are there to be asked; 9 runs are missing."],
        ),
        (Verdict("P1", "Another paper's.", PARTLY, levels={"ratio": 2}), ["(2 ratios.)"]),
        (
            Verdict("B1", "", PARTLY, **SCOPE, numbers={"better": Estimate(0.5, 0.25, 0.75)} |
                    {"first": 0.1, "second": -0.02}),
            ["less than one of GES with probability 0.50 [0.25, 0.75]", "by +10.0% and -2.0%"],
        ),
        (Verdict("B1", "", UNDECIDABLE, **SCOPE), ["TDC and GES were not run together."]),
        (
            Verdict("C8", "", PARTLY, assumptions=MADE),
            ["1 of 2 of Maei et al. (2009) and 1 of 1 of Maei et al. (2010) do not", "run: a."],
        ),
        (
            Verdict("C3", "", PARTLY, numbers={"ipopt": RATIO, "fatrop": RATIO}),
            ["of ES, 0.62 [0.60, 0.65] with ipopt, 0.62 [0.60, 0.65] with fatrop: one solve"],
        ),
        (
            Verdict("C3", "", UNDECIDABLE, numbers={"ipopt": RATIO}),
            ["the machine was too busy, the process waited for 50% of the time."],
        ),
        (
            Verdict("C3", "", UNDECIDABLE, numbers={"ipopt": replace(RATIO, waited=0.0)}),
            ["the interval reaches across a border of the claim."],
        ),
        (
            Verdict("C3", "", UNDECIDABLE, numbers={"ipopt": replace(RATIO, low=np.nan)}),
            ["too few steps were timed."],
        ),
        (Verdict("C3", "", UNDECIDABLE), ["RDES and ES were not timed with ipopt."]),
    ],
)  # fmt: skip
def test_the_evidence_has_every_number(verdict, sentences):
    found = evidence(verdict)
    assert all(one in found for one in sentences), found


def test_claims_of_several_learners_are_counted_by_learner():
    c9 = Verdict("W9", "", PARTLY, by_learner={"ES": (1, 2), "DES": (0, 2)})
    assert by_learner(c9) == "It holds in 1 of 2 runs of ES, 0 of 2 runs of DES."
    c7 = replace(c9, claim="C7", numbers={"eval_inside": {"ES": 7.0, "DES": 0.0}})
    assert by_learner(c7).endswith("states in an obstacle: 7 of ES, 0 of DES.")
    assert by_learner(replace(c9, claim="C5")) == ""


@pytest.mark.parametrize("claim", ["C1", "C2", "C5", "C6", "C7", "W7", "C8", "C9", "W9", "B1"])
def test_every_published_verdict_has_its_sentences(claim):
    found = evidence(published.load().verdict(claim))
    assert "{" not in found
    assert "inf" not in found
    assert "nan" not in found


def test_an_infinite_number_has_its_sign():
    assert [shown(v, ".1%") for v in (0.5, np.inf, -np.inf)] == ["50.0%", "∞", "-∞"]
