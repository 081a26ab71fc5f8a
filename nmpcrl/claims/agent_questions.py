"""What is asked of SAC and TD3, and how they are tuned and judged: fixed before any was.

Nothing stands here but definitions, so that anybody can check it: the code of this file is that of
the commit which added it, and that commit is older than every run that is published of it; a test
asks git. What is decided otherwise later is listed in `prespecified`, and this file stays.

**Information.** An agent sees the robot's state, where the target is, and the obstacles' centres,
and is told after each step what it cost. It has no model: not of the robot, not of the cost, and
not how large an obstacle is. A tuner of theta has a controller with all of that, of which only
nine numbers are to be found. So the two do not start from the same, and that is what is compared.

**Interaction** is counted in episodes, which are of 130 steps each, and begins from nothing. A
policy is judged by a rollout without noise, and by Eq. (20), as everything else is; the rollouts of
a curve's checkpoints are the judge's, not counted, and no agent sees them.

**Tuning.** Each agent has four settings, as each remedy had, in three layouts of `TUNE` with 150
episodes. The one with the least mean of J / J_init over these layouts is judged; of equal ones the
first. Such a tuning has 1800 episodes, and a remedy's 3000, since an episode of an agent takes some
thirty times as long.

**Parts.** `judge`: each layout from nothing, with 300 episodes. `one`: layout A. `all`: one agent
for every layout, trained in those of `TUNE`, one drawn for each episode, and judged without further
learning in `TUNE` and in `JUDGE`. In the two long parts there is at most `SPARING` gradient steps a
step. An agent **matches** theta_init where its rollout costs no more, and **solves** a layout where
it also ends at the target. `Bayes`, the remedy to try first, has 50 episodes a layout, and its cost
is the mean over the seeds that are published of it.

**Left out.** More gradient steps than steps, other rates, buffers and discounts than those of
`analysis.agents`, demonstrations by the NMPC, and agents that act on theta.

**Price.** At most 2.5 hours of one core. On cores that were shared an episode took 0.47 s with SAC
and half a gradient step a step; with TD3 0.27 s with half a one and 0.40 s with a whole one.

Pilots had been seen by then, one run each in T01. J / J_init without noise: SAC with half a
gradient step a step, after 200 episodes 1.14 with rewards of 0.01 and 1.03 with 0.1; TD3 0.91 after
300 with 0.01 and a whole one, and 1.35 after 200 with 0.1 and half a one. None was at the target at
the end.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from nmpcrl.claims.population_questions import Question
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Outcome

AGENTS = ("SAC", "TD3")
_SETTINGS: tuple[Mapping[str, float], ...] = ({}, {"turn": 0.5}, {"gradient": 0.5, "width": 128})
SETTINGS: Mapping[str, tuple[Mapping[str, float], ...]] = {  # the one it ships with first
    "SAC": (*_SETTINGS, {"reward": 0.01}),
    "TD3": (*_SETTINGS, {"reward": 0.1}),
}
SPARING = 0.5  # gradient steps a step, at most, in `LONG`
SEARCH, SEARCHED = "Bayes", ("judge 50", "named 50")  # the best search, in these published parts


@dataclass(frozen=True)
class Part:
    """What is trained together."""

    places: tuple[str, ...]  # a layout, or `EVERY`
    checkpoints: tuple[int, ...]  # episodes after which the policy is judged; the last ends it
    seeds: int  # a place

    @property
    def budget(self) -> int:
        """Episodes of a run."""
        return self.checkpoints[-1]


EVERY = "T01 to T60"  # the place of an agent that is trained in all of `TUNE`
PARTS: Mapping[str, Part] = {
    "tune": Part(("T01", "T02", "T03"), (150,), 1),
    "judge": Part(
        tuple(f"J{i:03}" for i in range(1, 7)), (25, 50, 100, 150, 200, 250, 300), 1
    ),
    "one": Part(("A",), (25, 50, 100, 150, 200, 300, 400, 500, 600), 4),
    "all": Part((EVERY,), (50, 100, 200, 300, 500, 750, 1000, 1250, 1600), 2),
}  # fmt: skip
LONG = ("one", "all")

_READ = "the share of yes is read by `rule.read`"
_JUDGED = "the layouts of `judge`"
_EXPECTED: Mapping[str, tuple[Outcome, Outcome]] = {  # of SAC and of TD3
    "matches in 300 episodes": (PARTLY, PARTLY),
    "solves in 300 episodes": (NOT, NOT),
    "or the best search": (NOT, NOT),
    "matches in one layout": (REPRODUCED, REPRODUCED),
    "or the best search in one layout": (NOT, NOT),
    "matches over the 60": (PARTLY, PARTLY),
    "matches on the 120": (NOT, NOT),
    "or the best search on the 120": (NOT, NOT),
}


def _questions(agent: str) -> tuple[Question, ...]:
    """What is asked of one agent."""
    last = {name: part.budget for name, part in PARTS.items()}
    searched = f"{SEARCH} with 50"
    asked = {
        "matches in 300 episodes": (
            f"Does {agent} match theta_init with {last['judge']} episodes?",
            _JUDGED,
            "the cost of its policy at the end, and theta_init's",
            f"yes if it is no more; {_READ}",
        ),
        "solves in 300 episodes": (
            f"Does {agent} solve the layout with {last['judge']} episodes?",
            _JUDGED,
            "the cost of its policy at the end, and whether the robot is then at the target",
            f"yes if it is, and costs no more than under theta_init; {_READ}",
        ),
        "or the best search": (
            f"Does {agent} with {last['judge']} episodes cost less than {searched}?",
            _JUDGED,
            "the two costs in a layout; the median of their ratio beside it",
            f"yes if that of {agent} is lower; {_READ}",
        ),
        "matches in one layout": (
            f"Does {agent} match theta_init within {last['one']} episodes in layout A?",
            "the seeds of `one`",
            "the cost at each checkpoint; beside it the first at which the median over seeds"
            " matches, and the first from which on it always does",
            f"yes if it matches at one of them; {_READ}",
        ),
        "or the best search in one layout": (
            f"Does {agent} with {last['one']} episodes cost less in A than {searched}?",
            "the seeds of `one`",
            f"the cost at the end, and the mean cost of {SEARCH} over its seeds",
            f"yes if that of {agent} is lower; {_READ}",
        ),
        "matches over the 60": (
            f"Does one {agent} for all match theta_init in the layouts it was trained in?",
            "the 60 layouts of `TUNE`",
            f"J / J_init after {last['all']} episodes, the mean over seeds; beside it the first"
            " checkpoint at which the median over layouts matches, and the first from which on it"
            " always does",
            f"yes if it is at most 1; {_READ}",
        ),
        "matches on the 120": (
            f"Does one {agent} for all match theta_init in layouts that it has never seen?",
            "the 120 layouts of `JUDGE`",
            "as over the 60",
            f"yes if it is at most 1; {_READ}",
        ),
        "or the best search on the 120": (
            f"Does one {agent} for all cost less, in layouts never seen, than {searched} there?",
            "the 120 layouts of `JUDGE`",
            "the mean cost over seeds at the end, and that of the search",
            f"yes if that of {agent} is lower; {_READ}",
        ),
    }
    index = AGENTS.index(agent)
    return tuple(
        Question(f"{agent} {name}", "", *words, _EXPECTED[name][index])
        for name, words in asked.items()
    )


AGENT_QUESTIONS: Mapping[str, Question] = {
    one.name: one
    for one in (
        *(question for agent in AGENTS for question in _questions(agent)),
        Question(
            "SAC or TD3",
            "",
            "Does SAC cost less than TD3 with 300 episodes each?",
            _JUDGED,
            "the two costs at the end; the median of their ratio beside it",
            f"yes if that of SAC is lower; {_READ}",
            PARTLY,
        ),
    )
}
