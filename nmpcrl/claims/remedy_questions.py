"""Which remedies are compared, how, and what we expect: fixed before any was tuned or judged.

Nothing stands here but definitions, so that anybody can check it: the code of this file is that of
the commit which added it, and that commit is older than every run of the comparison; a test asks
git. What is decided otherwise later is listed in `prespecified`, and this file stays.

**Interaction.** Every episode counts: with noise, confirming, or of a tuner. An entry has 50 or 300
a layout and seed, and begins from theta_init and nothing else.

**Tuning.** Each entry that has a setting is run with `RUNS_OF_TUNING` of them, the one it ships
with first, in the first layouts of `TUNE` with one seed and 50 episodes. The best by the measure
below is judged, at 50 and at 300 episodes; of equal ones the first. `grid` and `frozen` have no
setting, and spend nothing on it.

**Measure.** The share of the possible gain, (J_init - J) / (J_init - J_best), of rollouts without
noise. J_best of a layout is the lowest cost in a CMA-ES of `YARDSTICK` rollouts, so that a share
may pass 1. A row has the interquartile mean over layouts of the mean over seeds, with an interval
of 95 % by a bootstrap over layouts. Layouts where less than `LEAST_GAIN` of J_init can be gained
are left out of it, and counted. A failed solve costs infinitely much.

**Solved** is a layout if under every seed the robot is at its target at the end of that rollout,
and it cost no more than under theta_init, whatever can be gained.

**What to try.** Of the rows on the layouts to judge on, by `ADVICE`.

**Price.** A layout took 0.1 to 3.1 s with 50 episodes, and up to 23 s with 300, on one core; all
that is compared is to take at most 3.5 hours of one. So `DEAR` entries are judged in fewer layouts
with 300 episodes, where everything has one seed, and the controls of the guard with 50 only.

Pilots had been seen by then: their sentences are below, and each is confirmed or contradicted by
name. So had the gains of every entry, as it ships, in T01 to T03 with 50 episodes and in T01 with
300, from which the prices are; and that in A to F 1000 rollouts of the yardstick gain 0.99 or more
of what the published searches of 2000 do.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from nmpcrl.claims.population_questions import Question
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED

Setting = Mapping[str, float]

YARDSTICK, YARDSTICK_SEED = 1000, 9_000_000  # rollouts of the CMA-ES that finds J_best, its seed
LEAST_GAIN = 0.005  # of J_init; where less is possible, the share would be noise
RUNS_OF_TUNING = 4  # settings of an entry that has any
HALF = 0.5  # of the layouts; who solves surely fewer is never advised
DIGITS = 2  # of the ends of intervals that are compared

_STEP_SIZES = tuple({"alpha": alpha} for alpha in (1e-7, 3e-8, 3e-7, 1e-6))
_RADII = tuple({"radius": radius} for radius in (0.3, 0.1, 0.03, 1.0))

# What is compared; beta of GES and TDC keeps its ratio to alpha, and radii are in `SCALE`s.
SETTINGS: Mapping[str, tuple[Setting, ...]] = {
    "frozen": (),
    "grid": (),
    "ES": _STEP_SIZES,
    "GES": _STEP_SIZES,
    "TDC": _STEP_SIZES,
    "RDES": _STEP_SIZES,
    "DES": _STEP_SIZES,
    "TDRC": (
        {"alpha": 1e-7, "regularisation": 1.0},
        {"alpha": 3e-7, "regularisation": 1.0},
        {"alpha": 1e-7, "regularisation": 1e6},
        {"alpha": 3e-7, "regularisation": 1e6},
    ),
    "GES-3": _STEP_SIZES,
    "guarded-ES": _STEP_SIZES,
    "guarded-RDES": _STEP_SIZES,
    "control-RDES": _STEP_SIZES,
    "averaged-ES": _STEP_SIZES,
    "undone-ES": _STEP_SIZES,
    "undone-LSTD-Q": _RADII,
    "GN-J": _RADII,
    "undone-GN-J": _RADII,
    "DPG": _RADII,
    "SPSA": (
        {"step": 0.1, "perturbed": 0.05},
        {"step": 0.03, "perturbed": 0.05},
        {"step": 0.3, "perturbed": 0.05},
        {"step": 0.1, "perturbed": 0.15},
    ),
    "CMA-ES": tuple({"spread": spread} for spread in (0.3, 0.1, 0.05, 0.6)),
    "Bayes": tuple({"nearby": nearby} for nearby in (1.0, 0.5, 0.25, 2.0)),
}
CONTROLS = ("guarded-RDES", "control-RDES")  # of what a guard does
DEAR = ("RDES", "DES", "GN-J", "undone-GN-J", "DPG")  # more than a second a layout at 50


@dataclass(frozen=True)
class Part:
    """What is judged together."""

    budget: int  # episodes
    layouts: tuple[str, ...]
    seeds: int  # a layout
    fewer: Mapping[str, int]  # entries that are judged in the first so many layouts only

    def layouts_of(self, entry: str) -> tuple[str, ...]:
        """Where an entry is run."""
        return self.layouts[: self.fewer.get(entry, len(self.layouts))]


_TUNED = tuple(f"T{i:02}" for i in range(1, 16))
_JUDGED = tuple(f"J{i:03}" for i in range(1, 121))
_NAMED = ("A", "B", "C", "D", "E", "F")
_NONE = dict.fromkeys(CONTROLS, 0)

PARTS: Mapping[str, Part] = {
    "tune": Part(50, _TUNED, 1, {}),
    "judge 50": Part(50, _JUDGED, 2, {"GN-J": 60}),
    "judge 300": Part(300, _JUDGED[:60], 1, {**dict.fromkeys(DEAR, 20), **_NONE}),
    "named 50": Part(50, _NAMED, 10, {}),
    "named 300": Part(300, _NAMED, 2, {**dict.fromkeys(DEAR, 0), **_NONE}),
}
ADVISED = ("judge 50", "judge 300")  # the parts whose rows are advised on

FIRST, SECOND, LATER, OPEN, NEVER = "first", "second", "later", "open", "never"
ADVICE: Mapping[str, str] = {  # in the order in which they are asked; `frozen` is not advised on
    NEVER: "at every budget at which it is judged, the share of the possible gain lies below 0 with"
    f" its interval, or the share of solved layouts lies below {HALF} with its interval",
    OPEN: "the interval of the gain begins at or below 0 at one of the budgets",
    FIRST: "the greatest lower end with 50 episodes; those that agree to two digits are ordered by"
    " the lower end with 300, and then by processor time with 50",
    SECOND: "the next one",
    LATER: "all others",
}
EXPECTED_FIRST: Mapping[int, str] = {50: "undone-GN-J", 300: "CMA-ES"}  # greatest lower end
EXPECTED_NEVER = ("DPG",)

REMEDY_QUESTIONS: Mapping[str, Question] = {
    one.name: one
    for one in (
        Question(
            "search and learning",
            "CMA-ES with 300 rollouts has 0.98, 1.0, 0.99, 0.99, 0.71 and 0.38 of the possible gain"
            " in A to F, where ES has 0.53, 0.47, 0.72 and 0.45 and fails.",
            "Has CMA-ES more of the possible gain than ES with 300 episodes each?",
            "the layouts of `judge 300`",
            "the two shares of the possible gain in a layout",
            "yes if that of CMA-ES is greater; the share of yes is read by `rule.read`",
            REPRODUCED,
        ),
        Question(
            "search nears the best",
            "CMA-ES with 300 rollouts has 0.98, 1.0, 0.99, 0.99, 0.71 and 0.38 of the possible gain"
            " in A to F.",
            "Has CMA-ES at least 0.9 of the possible gain with 300 rollouts?",
            "the layouts of `judge 300`",
            "the share of the possible gain in a layout",
            "yes if it is at least 0.9; the share of yes is read",
            PARTLY,
        ),
        Question(
            "undone steps on the loop's cost gain",
            "Gauss-Newton with undo gained in 18 of 18.",
            "Does undone-GN-J gain?",
            "the layouts of `judge 50`",
            "the mean cost over seeds",
            "yes if it is below that of theta_init; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "undone steps on the TD error gain",
            "Gauss-Newton with undo gained in 18 of 18.",
            "Does undone-LSTD-Q gain?",
            "the layouts of `judge 50`",
            "the mean cost over seeds",
            "yes if it is below that of theta_init; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "one number by hand",
            "theta_c by hand does better than GES wherever the robot still arrives.",
            "Does the grid over theta_c cost less than GES with 300 episodes?",
            "the layouts of `judge 300` in which the robot arrives with what the grid found",
            "the two costs in a layout",
            "yes if that of the grid is lower; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "faster auxiliary weights",
            "",
            "Has GES with beta = 3 alpha and a normalised step more of the gain than GES?",
            "the layouts of `judge 50`",
            "the difference of the shares of the possible gain, its interquartile mean over layouts"
            " with its interval",
            "confirmed if the interval lies above 0, contradicted if it lies below, otherwise in"
            " part",
            PARTLY,
        ),
        Question(
            "guard",
            "The guard stops the overshoot.",
            "Does RDES with the guard solve the layout where RDES with that step size does not?",
            "the layouts of `tune` that RDES does not solve with one step size or more",
            "solved, by layout and step size",
            "yes if it solves with more than half of those step sizes; the share of yes is read",
            REPRODUCED,
        ),
        Question(
            "lengths or directions",
            "",
            "Has RDES with the guard more of the gain than its lengths in ES's direction?",
            "the layouts of `judge 50`",
            "the difference of the shares of the possible gain between guarded-RDES and"
            " control-RDES, as of the auxiliary weights",
            "confirmed if the interval lies above 0, contradicted if it lies below, otherwise in"
            " part",
            NOT,
        ),
        Question(
            "averaging",
            "",
            "Has the averaged theta of ES more of the gain than its last theta?",
            "the layouts of `judge 50`",
            "the difference of the shares of the possible gain between averaged-ES and ES, as of"
            " the auxiliary weights",
            "confirmed if the interval lies above 0, contradicted if it lies below, otherwise in"
            " part",
            NOT,
        ),
        Question(
            "undo",
            "",
            "Has ES with undo more of the gain than ES with as much interaction?",
            "the layouts of `judge 50`",
            "the difference of the shares of the possible gain between undone-ES and ES, as of the"
            " auxiliary weights",
            "confirmed if the interval lies above 0, contradicted if it lies below, otherwise in"
            " part",
            PARTLY,
        ),
    )
}
