"""Judgements of entries, stored one by one in the folder of the runs."""

from collections.abc import Iterable
from typing import Any

from nmpcrl.analysis.kept import Kept, Wanted
from nmpcrl.analysis.suite import EPOCH, Judgement, entry, gain, judge
from nmpcrl.study.provenance import epochs, installed, versions

LIBRARIES = ("cma", "optuna")  # beside those of every run


def judge_all(
    wanted: Iterable[Wanted], *, workers: int | None = None, progress: bool = True
) -> dict[Wanted, Judgement]:
    """Judge the missing ones: `Kept.complete`."""
    return KEPT.complete(
        wanted,
        judge_named,
        before=_compile_ahead,
        said=lambda one, judged: f"{one.entry} in {one.layout}: {gain(judged):.1%}",
        workers=workers,
        progress=progress,
    )


def judge_named(one: Wanted) -> Judgement:
    """Judge one."""
    return judge(entry(one.entry), one.layout, one.seed, one.budget)


def stored(wanted: Iterable[Wanted]) -> dict[Wanted, Judgement]:
    """The stored ones."""
    return KEPT.stored(wanted)


def depends_on() -> dict[str, Any]:
    """Everything that the numbers depend on, beside the entry, the layout and the seed."""
    libraries = {name: installed(name) for name in LIBRARIES}
    return {"epochs": epochs(), "suite": EPOCH, **versions(), **libraries}


def _compile_ahead(missing: Iterable[Wanted]) -> None:
    """Call each kind of entry once, so that no judgement's time includes a compilation."""
    for name in {entry(one.entry).name: None for one in missing}:
        judge(entry(name), "J001", 0, 3)


KEPT: Kept[Judgement] = Kept("suite", Judgement, lambda: depends_on())
