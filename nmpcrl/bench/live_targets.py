"""The targets of the live figures, with what was measured of them."""

from collections.abc import Iterator

import numpy as np

from nmpcrl.bench.live import LABORATORY, LEARNERS, Live
from nmpcrl.bench.targets import Target
from nmpcrl.study import paper

SOLVE = 1.5  # times as long in Chromium as in machine code
DRAG = (16.0, 33.0)  # [ms] median and 95th percentile of a frame
FIT = 1.0  # [ms] of the network
RUN = 1.6  # times as long in a page as here
WEIGHT = 200.0  # [kB] of a chapter
FIRST = 300.0  # [ms]


def live_targets(found: Live) -> list[Target]:
    """Every target of the live figures; what is not in `found` was not measured."""
    return [
        _solve(found),
        _drag(found),
        _fit(found),
        *_runs(found),
        _weight(found),
        *_quiet(found),
        _first(found),
    ]


def _missing(what: str, to_reach: str) -> Target:
    return Target(what, to_reach, "–", None)


def _solve(found: Live) -> Target:
    what, to_reach = "a warm solve in Chromium", f"at most {SOLVE}x as long as in machine code"
    if "page" not in found:
        return _missing(what, to_reach)
    there, here = np.array(found["page"]), np.array(found["native"])
    times = float(np.median(there / here))
    shown = f"{times:.2f}x ({np.median(there):.0f} µs, {np.median(here):.0f} µs)"
    return Target(what, to_reach, shown, times <= SOLVE)


def _drag(found: Live) -> Target:
    median, p95 = DRAG
    what = f"dragging: to plan {paper.STEPS} steps and draw them"
    to_reach = f"at most {median:.0f} ms median, {p95:.0f} ms p95"
    if not found.get("drag"):
        return _missing(what, to_reach)
    middle, high = np.percentile(found["drag"], [50, 95])
    return Target(
        what, to_reach, f"{middle:.0f} ms, {high:.0f} ms", bool(middle <= median and high <= p95)
    )


def _fit(found: Live) -> Target:
    what, to_reach = "a fit of the network in a page", f"at most {FIT:.0f} ms"
    if not found.get("fit"):
        return _missing(what, to_reach)
    took = float(np.median(found["fit"]))
    return Target(what, to_reach, f"{took:.2f} ms", took <= FIT)


def _runs(found: Live) -> Iterator[Target]:
    for learner in LEARNERS:
        what = f"{paper.EPISODES} episodes of {learner} in the laboratory"
        to_reach = f"at most {RUN}x as long as with `nmpcrl train`"
        one = found.get("runs", {}).get(learner)
        if one is None:
            yield _missing(what, to_reach)
            continue
        times = one["page"] / one["native"]
        shown = f"{times:.2f}x ({one['page']:.1f} s, {one['native']:.1f} s)"
        yield Target(what, to_reach, shown, times <= RUN)


def _weight(found: Live) -> Target:
    what, to_reach = "what live figures add to a chapter", f"at most {WEIGHT:.0f} kB"
    chapters = {page: size for page, size in found.get("weights", {}).items() if page != LABORATORY}
    if not chapters:
        return _missing(what, to_reach)
    page = max(chapters, key=lambda one: chapters[one])
    size = chapters[page] / 1000
    return Target(what, to_reach, f"{size:.0f} kB ({page})", size <= WEIGHT)


def _quiet(found: Live) -> Iterator[Target]:
    for name, what in (("requests", "external requests"), ("errors", "errors in the console")):
        counts = found.get(name)
        if not counts:
            yield _missing(what, "0")
            continue
        count = int(sum(counts.values()))
        yield Target(what, "0", f"{count} on {len(counts)} pages", count == 0)


def _first(found: Live) -> Target:
    what, to_reach = (
        "until a live figure works, after the page has loaded",
        f"at most {FIRST:.0f} ms",
    )
    if not found.get("first"):
        return _missing(what, to_reach)
    slowest = max(found["first"], key=lambda page: found["first"][page])
    took = found["first"][slowest]
    return Target(what, to_reach, f"{took:.0f} ms ({slowest})", took <= FIRST)
