"""What is asked of the population of layouts, and what we expect, fixed before it was trained on.

Nothing stands here but definitions, so that anybody can check it: the code of this file is that of
the commit which added it, and that commit is older than every run of the population; a test asks
git. What is decided otherwise later is listed in `prespecified`, and this file stays.

The unit is a layout. Where a claim is put to a layout it has several answers there, one or two in
each reading of the decay, and it holds there if more than `MAJORITY` of them are yes. The shares of
layouts are read by `rule.read`. Pilots, of few seeds in A to F, had been seen by then, and so are
their sentences: each is confirmed or contradicted by name.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Outcome

CLOSES_BEFORE = 0.2  # theta_c; the pilot: below it the first gap of the first trajectory closes
SAME_CLOSING = 0.05  # of theta_c: the step of the grid on which two horizons close the same gap
RAISED_TO = 0.5  # the end of that grid
STANDING = 0.05  # [m]; a robot stands if it moves less in the last `STOOD` steps of a rollout
STOOD = 10
CLIFF_RAISED = 0.02  # share by which the best theta_c is raised, beside the cliff
CLIFF_COST = 0.5  # share of the best cost that this adds
DEAD_BY = 20  # episodes: a run that was stopped by then overshot early
RIDGE = 1.0  # penalty of the logistic regression, of the squared slope of the standardised measure
RESAMPLES = 2000  # of the bootstrap over layouts

WORDS = {REPRODUCED: "confirmed", PARTLY: "confirmed in part", NOT: "contradicted"}


@dataclass(frozen=True)
class Share:
    """In which share of the layouts a claim is expected to hold."""

    low: float
    high: float
    outcome: Outcome  # by `rule.read`

    def __contains__(self, share: float) -> bool:
        return self.low <= share <= self.high


# The claim on a learner's cost, C9's, is put to each learner by itself; "C9" joins RDES and GES.
EXPECTED: Mapping[str, Share] = {
    "C1": Share(0.05, 0.35, PARTLY),
    "C2": Share(0.0, 0.05, NOT),
    "C5": Share(0.25, 0.7, PARTLY),
    "C6": Share(0.9, 1.0, REPRODUCED),
    "C7": Share(0.0, 0.1, NOT),
    "C9": Share(0.75, 0.95, PARTLY),
    "W7": Share(0.0, 0.1, NOT),
    "W9": Share(0.7, 0.95, PARTLY),
    "B1": Share(0.1, 0.5, PARTLY),
    "ES improves": Share(0.85, 0.97, REPRODUCED),
    "GES improves": Share(0.85, 0.97, REPRODUCED),
    "TDC improves": Share(0.85, 1.0, REPRODUCED),
    "RDES improves": Share(0.7, 0.95, PARTLY),
    "DES improves": Share(0.3, 0.8, PARTLY),
}


@dataclass(frozen=True)
class Question:
    """One question, and how it is decided."""

    name: str
    pilot: str  # the sentence that is confirmed or contradicted; "" if there was no pilot
    question: str
    asked_of: str  # which layouts or runs
    measured: str
    border: str  # where yes ends, and how the answers become an outcome
    expected: Outcome


QUESTIONS: Mapping[str, Question] = {
    one.name: one
    for one in (
        Question(
            "closing gaps",
            "ES fails exactly where the first gap of the first trajectory closes at theta_c below"
            f" {CLOSES_BEFORE}.",
            "Does ES fail where the gap closes by then, and succeed where it does not?",
            "the 120 layouts to judge on",
            "whether ES improves in the layout, as `EXPECTED` has it; theta_c at which the first"
            " gap closes, of `analysis.difficulty`",
            "both halves are read by themselves: the share of failures where the gap closes, and"
            " that of successes where it does not; confirmed if both are, contradicted if one is",
            PARTLY,
        ),
        Question(
            "predictors",
            "",
            "Does the closing of the first gap tell better than each rival where ES succeeds?",
            "the 120 layouts to judge on; each predictor is a logistic regression of one measure,"
            " fitted on the 60 to tune on",
            "the area under the ROC curve minus that of the rival, the rivals being the other"
            " measures of `analysis.difficulty`; Brier scores beside it",
            "confirmed if the interval of the difference, by bootstrap over layouts, lies above 0"
            " for every rival; contradicted if it lies below 0 for one; otherwise in part",
            PARTLY,
        ),
        Question(
            "horizon",
            "The horizon was not too short.",
            "Does ES still fail with N = 20 and N = 40 where it fails with N = 10?",
            "those of the 30 compared layouts in which ES with N = 10 fails",
            "whether ES improves in the layout, with the first seed, in both readings",
            "yes if it fails at both; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "gaps and horizon",
            "A gap closes at the same theta_c whatever the horizon.",
            "With theta_c raised and nothing learned, does the robot stop arriving at the same"
            " theta_c for N = 10, 20 and 40?",
            f"the compared layouts where it stops arriving with N = 10 up to theta_c = {RAISED_TO}",
            "the least theta_c on the grid at which the rollout does not arrive",
            f"yes if the three differ by at most {SAME_CLOSING}; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "trap",
            "The robot stands, and the plan's value is below l / (1 - gamma): so delta > 0 and"
            " theta_c grows.",
            "Is that so where ES ends without having arrived?",
            "the layouts to judge on in which a run of ES does not arrive",
            "movement in the last steps without noise, and V there at the final theta",
            f"a run: it moves less than {STANDING} m in {STOOD} steps and V < l / (1 - gamma); a"
            " layout: all such runs; the share of layouts is read",
            REPRODUCED,
        ),
        Question(
            "accurate and worse",
            "In the trap the value gets more accurate while the policy gets worse.",
            "Does |delta| fall while the noise-free cost rises?",
            "as of the trap",
            "root mean square of delta over the last 20 episodes and over the first 20; final and"
            " initial noise-free cost",
            "a run: the former falls and the latter rises; a layout: all such runs; read",
            REPRODUCED,
        ),
        Question(
            "cliff",
            "Beside the best theta, 1 to 2 % more theta_c costs 50 to 140 %.",
            f"Does theta_c raised by {CLIFF_RAISED:.0%} cost at least {CLIFF_COST:.0%}?",
            "layouts A to F at the best theta that is published, and with it alone",
            "noise-free cost",
            "the share of layouts with yes is read",
            PARTLY,
        ),
        Question(
            "early overshoot",
            "RDES overshoots early: most of its runs that are stopped have alpha ||phi||^2 > 2, and"
            f" most are dead by episode {DEAD_BY}.",
            "Is that so of RDES in the reading per episode with ES's alpha, and of no other?",
            "the published runs of A to F, and the 120 layouts beside them",
            "steps with alpha ||phi||^2 above 2; the episode in which the run was stopped",
            "confirmed if both shares lie above one half with their intervals in the population,"
            " contradicted if one lies below",
            REPRODUCED,
        ),
        Question(
            "extrapolation",
            "",
            "Does RDES survive if the network is asked with theta of the start of the episode, and"
            " nothing else is changed?",
            "the published conditions of layouts A to F in which RDES is stopped, reading per"
            " episode",
            "the same run with theta held as the input of what is predicted, from the start of an"
            " episode to its end; what is remembered and fitted has theta of its own step",
            "yes if it is not stopped; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "whole picture",
            "",
            "Is there a layout, reading and step size in which C1, C2, C5 and C9 hold together?",
            "every layout, reading and step size that was trained, A to F and their variants"
            " included; how many were tried is said",
            "the answers of all seeds there, with the claims' own borders",
            "confirmed if all answers are yes in one; otherwise contradicted, and the nearest is"
            " shown: where most of the four claims hold, and of those the most answers are yes",
            NOT,
        ),
    )
}
