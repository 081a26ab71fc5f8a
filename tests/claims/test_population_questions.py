"""What is asked of the population is complete."""

from nmpcrl.analysis import trap
from nmpcrl.claims import population_questions
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.population_questions import EXPECTED
from nmpcrl.claims.wider_claims import WIDER_CLAIMS
from nmpcrl.study.experiment import MAIN


def test_every_claim_that_runs_of_the_main_table_decide_has_an_expected_share():
    claims = {**BY_RUNS, **WIDER_CLAIMS, **OWN_CLAIMS}
    decided = {name for name, claim in claims.items() if {*claim.learners} <= {*MAIN}}
    alone = {f"{learner} improves" for learner in MAIN if learner != "frozen"}
    assert {*EXPECTED} == decided | alone


def test_an_expected_share_is_one():
    assert all(0 <= one.low < one.high <= 1 for one in EXPECTED.values())
    assert 0.3 in EXPECTED["C1"]
    assert 0.5 not in EXPECTED["C1"]


def test_a_robot_stands_over_as_many_steps_as_were_agreed():
    assert trap.STOOD == population_questions.STOOD
