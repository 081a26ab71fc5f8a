"""What is asked of worlds that move, change, or are not the model: fixed before anything was run.

Nothing stands here but definitions, so that anybody can check it: the code of this file is that of
the commit which added it, and that commit is older than every run that is published of it; a test
asks git. What is decided otherwise later is listed in `prespecified`, and this file stays.

**Places.** Scenarios are the 40 of `study.scenarios`; layouts are the first of `JUDGE`; a sequence
is a random order of `JUDGE`, of which each change brings the next. Each is a unit: of several seeds
the mean counts, and intervals are over places. A place has noise of its own, and two arms of a seed
meet the same.

**What is known.** An NMPC "knows" a motion over its horizon, "extrapolates" the velocity that it
saw since the step before, or takes the obstacles as "frozen" where they are. Of a layout that
changes it is "told"; detects it by a chart on an episode's summed "cost" or on its mean |"delta"|,
with the map of before until then; or "never" learns of it, and plans with the first layout.

**Costs** are of rollouts without noise on the action. In a layout that changes, the share is J over
J of theta_init in the same layout, told: so 1 is replanning with what one sees, without learning.
A cost is "back" at the first rollout after a change from which on, and until the next change, no
share exceeds the last one before the change by more than `BACK`. A failed solve costs infinitely
much.

**The model.** Bodies differ as in `study.faults.FAULTS`. An oracle has the parameters that fit the
fault; of a slip it knows the mean, and of a lag and of noise there is none.

**Left out.** A motion is polynomial, sinusoidal or straight as drawn: kinds are not compared.
Obstacles do not react. Networks of RDES and DES are not told the time or the layout.

**Price.** At most 4 hours of one core, of which a dry run of `nmpcrl world` says what is left.

Pilots had been seen by then: their sentences are below, and each is confirmed or contradicted by
name. So had J of theta_init and of the oracle in layout A under each fault, where the oracle cost
0.7 % more to 0.8 % less; and, of 20 to 40 episodes each, one run of some arms, from which the
prices are: in M02 "known init" and ES, CMA-ES and the grid with a frozen view; in J001 "drift ES",
"drift ES+model" and "slip oracle"; in S01 "ES told plain" and "RDES told recent" before any change.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from nmpcrl.claims.population_questions import Question
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED

BACK = 0.02  # of theta_init's cost: as much as a share may exceed that before the change
SOON = 50  # episodes: "back" within so many is soon
CLEARLY = 0.1  # share by which one predictor must cost more than another for that to be clear
LITTLE = 0.02  # of theta_init's cost: a perfect model is worth little if it gains less
MISFIT = 0.05  # of theta_init's cost: the least that the pilot's theta_c gains
ALIGNED = 0.9  # cosine of two steps that point the same way
PROMPT = 10  # episodes: a change is noticed promptly within so many
RARE = 0.01  # false alarms an episode, at most
RESAMPLES = 2000  # of the bootstrap over places

VIEWS = ("known", "extrapolated", "frozen")
ORACLES = ("speed", "turn", "drift", "slip")  # faults of which an oracle knows the model
WITHOUT = ("lag", "noise")
DEVIATIONS = ("0.02", "0.05", "0.1")  # [m] and [rad], of the measured state


@dataclass(frozen=True)
class Part:
    """What is run together."""

    budget: int  # episodes
    places: tuple[str, ...]
    arms: tuple[str, ...]
    seeds: int = 1  # a place
    once: tuple[str, ...] = ()  # arms that draw nothing: one seed
    fewer: Mapping[str, int] = field(default_factory=dict)  # arms of the first places only

    def runs(self, arm: str) -> tuple[tuple[str, int], ...]:
        """Place and number of the seed of each run of an arm."""
        places = self.places[: self.fewer.get(arm, len(self.places))]
        seeds = 1 if arm in self.once else self.seeds
        return tuple((place, k) for place in places for k in range(seeds))


_LAYOUTS = tuple(f"J{i:03}" for i in range(1, 121))
_SEQUENCES = tuple(f"S{i:02}" for i in range(1, 11))
_CHANGES = (
    *(f"ES {knows} plain" for knows in ("told", "cost", "delta", "never")),
    *(f"ES {knows} {how}" for knows in ("told", "cost") for how in ("raised", "reset")),
    *(f"{name} told {how}" for name in ("RDES", "DES") for how in ("plain", "recent")),
    *(f"frozen {knows} plain" for knows in ("cost", "delta", "never")),
)

REMEDY = "remedy"  # stands for "remedy ENTRY", the one of the comparison's to try first

PARTS: Mapping[str, Part] = {
    "moving": Part(
        50,
        tuple(f"M{i:02}" for i in range(1, 41)),
        tuple(f"{view} {how}" for view in VIEWS for how in ("init", "grid", "CMA-ES", "ES")),
        5,
        once=tuple(f"{view} {how}" for view in VIEWS for how in ("init", "grid")),
    ),
    "model": Part(
        100,
        _LAYOUTS[:12],
        (
            *(f"{fault} {how}" for fault in (*ORACLES, *WITHOUT)
              for how in ("init", "grid", "ES", "ES+model")),
            *(f"{fault} {how}" for fault in ORACLES for how in ("oracle", "oracle+ES")),
        ),
        2,
        once=(
            *(f"{fault} {how}" for fault in (*ORACLES, *WITHOUT) for how in ("init", "grid")),
            *(f"{fault} oracle" for fault in ORACLES),
        ),
    ),
    "once": Part(300, _SEQUENCES, (*_CHANGES, REMEDY), 1),
    "every 50": Part(300, _SEQUENCES, _CHANGES, 1),
    "random": Part(300, _SEQUENCES, _CHANGES, 1),
    "carry": Part(300, _LAYOUTS, ("frozen", "ES", "CMA-ES"), 1, fewer={"frozen": 1}),
    "gradient": Part(20, _LAYOUTS[:20], DEVIATIONS, 1),
}  # fmt: skip
CHANGES = ("once", "every 50", "random")

_CHANGED = "the sequences in which the layout changes"
_READ = "the share of yes is read by `rule.read`"

WORLD_QUESTIONS: Mapping[str, Question] = {
    one.name: one
    for one in (
        Question(
            "a velocity is enough",
            "The NMPC that extrapolates costs 6 % more than the one that knows the motion.",
            "Does extrapolating cost at most 10 % more than knowing, with theta_init?",
            "the scenarios",
            "the two costs in a scenario; the median of their ratio beside it",
            f"yes if the ratio is at most {1 + CLEARLY}; {_READ}",
            REPRODUCED,
        ),
        Question(
            "a frozen view costs more",
            "The NMPC that takes the obstacles as frozen costs 21 % more.",
            "Does a frozen view cost at least 10 % more than knowing, with theta_init?",
            "the scenarios",
            "the two costs in a scenario; the median of their ratio beside it",
            f"yes if the ratio is at least {1 + CLEARLY}; {_READ}",
            PARTLY,
        ),
        Question(
            "collisions",
            "All collisions are those of the NMPC that takes the obstacles as frozen.",
            "Is a frozen view alone in getting into an obstacle?",
            "the scenarios in which one of the three is inside an obstacle, with theta_init",
            "states inside an obstacle",
            f"yes if the two others have none; {_READ}",
            PARTLY,
        ),
        Question(
            "crowding",
            "",
            "Do more crowded scenarios have more states inside an obstacle?",
            "the scenarios, with theta_init and extrapolation",
            "the rank correlation of `encounters.crowding` and states inside",
            "confirmed if its interval, by bootstrap over scenarios, lies above 0; contradicted if"
            " it lies below; otherwise in part",
            REPRODUCED,
        ),
        Question(
            "learning among moving obstacles",
            "",
            "Does ES cost less than theta_init where it extrapolates?",
            "the scenarios",
            "the mean cost over seeds",
            f"yes if it is lower; {_READ}",
            REPRODUCED,
        ),
        Question(
            "learning or looking",
            "",
            "Does ES with a frozen view cost less than theta_init with extrapolation?",
            "the scenarios",
            "the mean cost over seeds",
            f"yes if it is lower; {_READ}",
            PARTLY,
        ),
        Question(
            "one number by hand among moving obstacles",
            "",
            "Does the grid over theta_c cost less than ES, where both extrapolate?",
            "the scenarios",
            "the mean cost over seeds",
            f"yes if that of the grid is lower; {_READ}",
            PARTLY,
        ),
        Question(
            "safer by learning",
            "",
            "Has ES fewer states inside an obstacle than theta_init, with extrapolation?",
            "the scenarios in which one of the two has any",
            "the mean number over seeds",
            f"yes if it is lower; {_READ}",
            NOT,
        ),
        Question(
            "a perfect model",
            "A perfect model is worth about 1 %.",
            "Does an oracle model save less than 2 % of the cost, with theta_init's weights?",
            "each fault of `ORACLES` in each layout",
            "the share of theta_init's cost that is saved, which may be below 0",
            f"yes if it is below {LITTLE}; {_READ}",
            REPRODUCED,
        ),
        Question(
            "misfit of theta_c",
            "The misfit of theta_c is worth 5 to 12 %.",
            "Does the best theta_c of the grid save at least 5 %?",
            "each fault in each layout",
            "the share of theta_init's cost that is saved",
            f"yes if it is at least {MISFIT}; {_READ}",
            PARTLY,
        ),
        Question(
            "only drift adds",
            "Only where the plant drifts does learning the model add to learning the weights.",
            "Does ES with the model's parameters cost less than ES, where the plant drifts?",
            "the layouts",
            "the mean cost over seeds; the same count of each other fault beside it",
            "yes if it is lower; read; and if that is confirmed, but one of the other faults that"
            " an oracle knows is confirmed by the same rule, it holds in part",
            PARTLY,
        ),
        Question(
            "recovered by weights",
            "",
            "Does ES, with the wrong model, cost less than the oracle model with theta_init?",
            "each fault of `ORACLES` in each layout",
            "the mean cost over seeds",
            f"yes if it is lower; {_READ}",
            PARTLY,
        ),
        Question(
            "noise and the gradient",
            "",
            "Does an episode's step of ES point where it would without measurement noise?",
            "the layouts, with a deviation of 0.05",
            "the cosine of the summed delta phi of 20 episodes at theta_init, with noise and"
            " without; the other deviations beside it",
            f"yes if it is at least {ALIGNED}; {_READ}",
            PARTLY,
        ),
        Question(
            "back soon",
            "",
            "Is the cost of ES back within 50 episodes, where it is told and goes on?",
            f"{_CHANGED} once",
            "the episodes until the cost is back",
            f"yes if they are at most {SOON}; {_READ}",
            PARTLY,
        ),
        *(
            Question(
                name,
                "",
                f"Does {first} cost less than {second} after a change?",
                f"{_CHANGED} every 50 episodes",
                "the mean share over all rollouts since the first change",
                f"yes if it is lower; {_READ}",
                expected,
            )
            for name, first, second, expected in (
                ("a raised rate", "ES told raised", "ES told plain", NOT),
                ("theta reset", "ES told reset", "ES told plain", NOT),
                ("recent replay in RDES", "RDES told recent", "RDES told plain", PARTLY),
                ("recent replay in DES", "DES told recent", "DES told plain", PARTLY),
                ("being told", "ES told plain", "ES never plain", REPRODUCED),
                ("detecting", "ES cost plain", "ES never plain", REPRODUCED),
            )
        ),
        Question(
            "a chart on the cost",
            "",
            "Is a change noticed within 10 episodes, with at most one false alarm in 100?",
            f"{_CHANGED} every 50 episodes, under ES with the chart on the cost",
            "the median delay of a sequence's changes, one that is not noticed before the next"
            " counting 50; and its alarms where the map was true, by episodes of such a map",
            f"yes if the one is at most {PROMPT} and the other at most {RARE}; {_READ}",
            PARTLY,
        ),
        Question(
            "a chart on the TD error",
            "",
            "Is a change noticed within 10 episodes, with at most one false alarm in 100?",
            f"{_CHANGED} every 50 episodes, under ES with the chart on the mean |delta|",
            "as of the chart on the cost",
            f"yes if the one is at most {PROMPT} and the other at most {RARE}; {_READ}",
            PARTLY,
        ),
        Question(
            "learning pays in a changing world",
            "",
            "Does ES, told and going on, cost less than replanning with theta_init?",
            f"{_CHANGED}, in all three ways",
            "the mean share over all rollouts since the first change, and over the three ways",
            f"yes if it is below 1; {_READ}",
            REPRODUCED,
        ),
        Question(
            "begun anew",
            "",
            "Does the remedy to try first, begun anew, end at a lower cost than ES that goes on?",
            f"{_CHANGED} once",
            "the last share of each",
            f"yes if that of the remedy is lower; {_READ}",
            REPRODUCED,
        ),
        Question(
            "carried over",
            "",
            "Does theta of ES cost less than theta_init in most other layouts?",
            "the 120 layouts to judge on, in each of which a theta is learned",
            "the share of the 119 others in which it costs less; that of CMA-ES beside it",
            f"yes if it is more than half; {_READ}",
            PARTLY,
        ),
    )
}
