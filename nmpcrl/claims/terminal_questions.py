"""What is asked of a richer terminal cost: fixed before anything was run.

Nothing stands here but definitions, so that anybody can check it: the code of this file is that of
the commit which added it, and that commit is older than every run that is published of it; a test
asks git. What is decided otherwise later is listed in `prespecified`, and this file stays.

A short horizon is forgiven by a good terminal cost. So where ES fails with N = 10, the paper's
weighted distance to the target may be what is too poor, as the horizon may be too short, which
`population_questions` asks. Three terminal costs are compared, of `study.world.TERMINALS`: the
paper's, a full quadratic, and one with a weight for each of 25 bumps over the plane, learned as all
of theta is. Where learning begins the three are one, so that each begins at the same cost.

**Arms** are the terminal costs, learned by ES with the paper's alpha and noise for 300 episodes, in
the reading per step, with the two seeds of `worlds.seed_of`; places are the 30 layouts in which
horizons were compared. Two arms of a seed meet the same noise. **Improves**: without noise the
robot is at the target at the end, and costs less than under theta_init; in a layout, under both
seeds. It *fails* where it does not.

**Price.** At most an hour of one core. No pilot was run.
"""

from collections.abc import Mapping

from nmpcrl.claims.population_questions import Question
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED
from nmpcrl.claims.world_questions import Part
from nmpcrl.study.population_design import COMPARED

ARMS = ("diagonal", "full", "learned")  # the paper's first
TERMINAL = Part(300, COMPARED, ARMS, 2)

_READ = "the share of yes is read by `rule.read`"
_FAILING = "those of the 30 compared layouts in which ES fails with the paper's terminal cost"

TERMINAL_QUESTIONS: Mapping[str, Question] = {
    one.name: one
    for one in (
        Question(
            "full terminal cost",
            "",
            "Does ES still fail with a full quadratic terminal cost where it fails with the"
            " paper's?",
            _FAILING,
            "whether ES improves in the layout",
            f"yes if it fails; {_READ}",
            REPRODUCED,
        ),
        Question(
            "learned terminal cost",
            "",
            "Does ES still fail with a learned terminal cost where it fails with the paper's?",
            _FAILING,
            "whether ES improves in the layout",
            f"yes if it fails; {_READ}",
            PARTLY,
        ),
        Question(
            "a richer terminal cost pays",
            "",
            "Does ES cost less with a learned terminal cost than with the paper's?",
            "the 30 compared layouts",
            "the mean cost over seeds, without noise; the median of their ratio beside it",
            f"yes if it is lower; {_READ}",
            NOT,
        ),
    )
}
