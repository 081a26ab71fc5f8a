"""What the introduction says first: the finding in two sentences, and four numbers with links."""

from nmpcrl.claims.finding import EARLY, LEARNERS, Finding
from nmpcrl.report.cited import Count
from nmpcrl.report.prose import filled
from nmpcrl.report.text import NOTHING, listed
from nmpcrl.study import paper

ORIGIN = "the published study"


def sentences(found: Finding | None) -> str:
    """The finding in two sentences, in Markdown."""
    if found is None:
        return NOTHING
    return filled(
        """
        **Without a network, reinforcement learning tunes this robot's controller well as long as
        the gaps on its way stay open, and leads the robot to a dead end where learning itself
        closes one.** One number set by hand saves {saved_by_hand:.0%} of the cost where learning
        saves {saved_there:.0%}, wherever the robot still arrives; and with a network, as in RDES,
        the paper's first method, learning can break down within {early} episodes.
        """,
        origin=ORIGIN,
        saved_by_hand=found.saved_by_hand,
        saved_there=found.saved_there,
        early=str(EARLY),
    )


def numbers(found: Finding | None) -> str:
    """Four numbers, each with a line and a link to its evidence: a list in Markdown."""
    if found is None:
        return NOTHING
    return filled(
        """
        - **{arrived_with_open_gaps}** runs of {learners} end at the target, at a cost that is
          {saved_where_it_arrived:.1%} lower (median), in which every gap stayed open.
          [Fig. 5.6](05_results.ipynb#fig-results-c9)
        - **{arrived_with_a_closed_gap}** runs of {learners} end at the target at a lower cost in
          which $\\theta_c$, which keeps plans away from obstacles, grew until a gap closed.
          [Fig. 5.1](05_results.ipynb#fig-results-reasons)
        - **{layouts_solved_by_hand}** layouts are solved with $\\theta_c$ set by hand to the margin
          that the cost names, in {better_by_hand} of them at a lower cost than in any run of
          {learners}. [In plain words](07_beyond.ipynb#beyond-plain-words)
        - **{stopped_runs_of_RDES}** runs of RDES had to be stopped when the noise decays per
          episode, {stopped_early} of them within {early} episodes.
          [Fig. 5.3](05_results.ipynb#fig-results-c1)
        """,
        origin=ORIGIN,
        arrived_with_open_gaps=Count(*found.arrived_open),
        arrived_with_a_closed_gap=Count(*found.arrived_closed),
        saved_where_it_arrived=found.learned,
        learners=listed(LEARNERS),
        layouts_solved_by_hand=Count(*found.by_hand),
        better_by_hand=Count(*found.better),
        stopped_runs_of_RDES=Count(*found.stopped),
        stopped_early=found.stopped_early,
        early=str(EARLY),
    )


def use(found: Finding | None) -> str:
    """Which learner to take and what that costs: two paragraphs in Markdown."""
    if found is None:
        return NOTHING
    return filled(
        """
        **Which learner.** ES or GES, which fit no network. TDC is the careful one: {astray_TDC} of
        its runs did not end at the target, against {astray_ES} of ES and {astray_GES} of GES, and
        it saves less ([Fig. 7.3](07_beyond.ipynb#fig-beyond-tdc)). A network pays only where a
        solve is slow ([Chapter 9](performance.ipynb)).

        **What it costs.** {episodes} episodes, in which the robot moves for
        {hours_of_the_robot:.1f} hours; simulated, {seconds_of_a_run_of_ES:.0f} seconds of one core
        ([Chapter 8](solver.ipynb)).
        """,
        origin=ORIGIN,
        episodes=str(paper.EPISODES),
        hours_of_the_robot=found.hours,
        seconds_of_a_run_of_ES=found.seconds,
        **{f"astray_{name}": Count(*count) for name, count in found.not_there.items()},
    )
