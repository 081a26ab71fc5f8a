"""What the introduction says first: the finding in two sentences, and four numbers with links."""

from nmpcrl.claims.finding import EARLY, LEARNERS, Finding
from nmpcrl.claims.thresholds import BETTER
from nmpcrl.report.cited import Cited, Count
from nmpcrl.report.prose import filled
from nmpcrl.report.text import NOTHING, listed
from nmpcrl.report.timing import PUBLISHED
from nmpcrl.study import paper

ORIGIN = "the published study"
BY_HAND = "by hand: rollouts of this build"


def sentences(found: Finding | None) -> str:
    """The finding in two sentences, in Markdown."""
    if found is None:
        return NOTHING
    return filled(
        """
        **Without a network, reinforcement learning tunes this robot's controller well as long as
        the gaps on its way stay open, and leads the robot to a dead end where learning itself
        closes one.** One number set by hand saves {saved_by_hand:.0%} in the {solved_by_hand}
        layouts where the robot still arrives, and learning {saved_there:.0%}; in the others it
        costs {least_lost_by_hand:.0%} to {most_lost_by_hand:.0%} more. The paper's network (RDES)
        broke down within {early} episodes in {early_per_episode} runs if noise decays per episode,
        and in {early_per_step} if per step.
        """,
        origin=ORIGIN,
        saved_by_hand=Cited(found.saved_by_hand, f"saved {BY_HAND}"),
        solved_by_hand=Cited(Count(*found.by_hand), f"layouts solved {BY_HAND}"),
        least_lost_by_hand=Cited(found.lost_by_hand[0], f"least lost {BY_HAND}"),
        most_lost_by_hand=Cited(found.lost_by_hand[1], f"most lost {BY_HAND}"),
        saved_there=found.saved_there,
        early=str(EARLY),
        early_per_episode=Count(found.stopped_early, found.stopped[1]),
        early_per_step=Count(found.early_per_step, found.stopped_per_step[1]),
    )


def numbers(found: Finding | None) -> str:
    """Four numbers, each with a line and a link to its evidence: a list in Markdown."""
    if found is None:
        return NOTHING
    return filled(
        """
        - **{arrived_with_open_gaps}** runs of {learners} reach the target in layouts {open_in},
          where no gap closed, at a cost that is {saved_where_it_arrived:.1%} lower (median).
          [Fig. 5.6](05_results.ipynb#fig-results-c9)
        - **{arrived_with_a_closed_gap}** runs of {learners} reach it in layouts {closed_in}: there
          learning raised $\\theta_c$, which keeps plans away from obstacles, until a gap closed.
          [Fig. 5.1](05_results.ipynb#fig-results-reasons)
        - **{layouts_solved_by_hand}** layouts are solved with $\\theta_c$ set by hand to
          {by_hand}, the margin that the cost names: the robot arrives at no higher cost. In
          {better_by_hand} of them it costs less than any run of {learners}; in the other layouts
          the robot does not arrive.
          [In plain words](07_beyond.ipynb#beyond-plain-words)
        - **{stopped_runs_of_RDES}** runs of RDES had to be stopped when the noise decays per
          episode, {stopped_early} of them within {early} episodes; per step {stopped_per_step} were
          stopped, and {early_per_step} so early. [Fig. 5.3](05_results.ipynb#fig-results-c1)
        """,
        origin=ORIGIN,
        arrived_with_open_gaps=Count(*found.arrived_open),
        arrived_with_a_closed_gap=Count(*found.arrived_closed),
        open_in=listed(found.open_in),
        closed_in=listed(found.closed_in),
        saved_where_it_arrived=found.learned,
        learners=listed(LEARNERS),
        by_hand=str(paper.task().margin),
        layouts_solved_by_hand=Cited(Count(*found.by_hand), f"layouts solved {BY_HAND}"),
        better_by_hand=Count(*found.better),
        stopped_runs_of_RDES=Count(*found.stopped),
        stopped_early=found.stopped_early,
        stopped_per_step=Count(*found.stopped_per_step),
        early_per_step=str(found.early_per_step),
        early=str(EARLY),
    )


def use(found: Finding | None) -> str:
    """Which learner to take and what that costs: two paragraphs in Markdown."""
    if found is None:
        return NOTHING
    return filled(
        """
        **Which learner.** ES or GES, which fit no network. TDC gets stuck less often: {astray_TDC}
        of its runs did not end at the target, against {astray_ES} of ES and {astray_GES} of GES.
        But {above_TDC} of its runs end above the cost that they began with, {worse_TDC} by more
        than {better:.0%}; of ES {worse_ES} do, of GES {worse_GES}
        ([Fig. 7.3](07_beyond.ipynb#fig-beyond-tdc)). A network pays only where a solve is slow
        ([the solver and its speed](solver.ipynb)).

        **What it costs.** {episodes} episodes, in which the robot moves for
        {hours_of_the_robot:.1f} hours; simulated, {seconds_of_a_run_of_ES:.0f} seconds of one core
        ([the solver](solver.ipynb)).
        """,
        origin=ORIGIN,
        episodes=str(paper.EPISODES),
        hours_of_the_robot=found.hours,
        seconds_of_a_run_of_ES=Cited(found.seconds, f"seconds of a run of ES: {PUBLISHED}"),
        above_TDC=Count(*found.above["TDC"]),
        better=BETTER,
        **{f"astray_{name}": Count(*count) for name, count in found.not_there.items()},
        **{f"worse_{name}": Count(*count) for name, count in found.worse.items()},
    )
