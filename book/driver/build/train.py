"""What chapters need before they are executed: runs, times, and code that is compiled."""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

from driver.project import Failure

if TYPE_CHECKING:
    from nmpcrl.claims.verdict import Verdict
    from nmpcrl.studies.reproduce import Pairs


def require_published() -> None:
    """End the build, before any work, if there is nothing to compare its runs with."""
    from nmpcrl.claims import published  # only here: a refusal should not wait for it

    try:
        published.load()
    except published.Damaged as error:
        raise Failure(str(error)) from error


@contextmanager
def compiling_for_pages() -> Iterator[None]:
    """Compile what live figures solve with beside other work: two chapters would wait for it."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as pool:
        compiled = pool.submit(compile_for_pages)
        yield
        compiled.result()


def compile_for_pages() -> None:
    """Compile these modules, unless they are kept; where they cannot be had, the figures say so."""
    from nmpcrl.control.codegen.source import CannotCompile
    from nmpcrl.learning import browser
    from nmpcrl.study import Experiment, moving
    from nmpcrl.study.setup import controller_of

    nmpc = controller_of(Experiment())
    with suppress(CannotCompile):
        browser.module(nmpc.plant, nmpc.task)
        browser.module(moving.problem())


def train(experiments: tuple[Any, ...], summaries: tuple[Any, ...]) -> None:
    """Run what is not stored yet; the bars are the store's."""
    from nmpcrl.analysis.summaries import fetch_summaries
    from nmpcrl.claims import published
    from nmpcrl.studies import reproduce
    from nmpcrl.study import Experiment
    from nmpcrl.study.lock import warn_of_changes
    from nmpcrl.study.setup import compile_ahead
    from nmpcrl.study.store import fetch_all

    warn_of_changes()  # no page is a place for this notice, nor for that of the compiler
    compile_ahead((*experiments, *summaries) or (Experiment(),))
    fetch_all(experiments, progress=True)
    made, known = fetch_summaries(summaries), published.load()
    contradictions = reproduce.compare(made, known)
    if len(contradictions):
        raise Failure(
            "Runs that were trained here contradict the published ones:\n"
            f"{contradictions.to_string(index=False)}"
        )
    refuse_verdicts(reproduce.of_runs(made, known))


def measure(calls: tuple[Callable[[], Any], ...]) -> None:
    """Time the learners with the machine to itself; times have their verdicts, too."""
    from nmpcrl.claims import published
    from nmpcrl.studies import reproduce

    for call in calls:
        refuse_verdicts(reproduce.of_times(call().timings, published.load()))


def refuse_verdicts(contradictions: "Pairs") -> None:
    """End the build if a verdict that was found here contradicts the published one."""
    if contradictions:
        listed = "\n".join(
            f"{here.claim} is {_outcome(here)} here, and {_outcome(there)} as published"
            for here, there in contradictions
        )
        raise Failure(f"Verdicts that were found here contradict the published ones:\n{listed}")


def _outcome(verdict: "Verdict") -> str:
    """The words of an outcome with the interval that it rests on."""
    if verdict.interval is None:
        return verdict.words
    return f"{verdict.words} [{verdict.interval[0]:.2f}, {verdict.interval[1]:.2f}]"
