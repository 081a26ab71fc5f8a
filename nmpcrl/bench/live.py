"""What the live figures of the built book reach, in a headless Chromium by the page's own clock."""

import json
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import nmpcrl
from nmpcrl.bench.solves import closed_loop, watched
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.files import folder, write_json
from nmpcrl.study.refusal import Refusal

Live = dict[str, Any]  # numbers by what is measured; what could not be is absent

SITE = Path(nmpcrl.__file__).parents[1] / "_build/html"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ("--no-sandbox", "--disable-background-networking", "--disable-sync")
FIGURE = '<figure class="live"'
LABORATORY = "laboratory.html"
FILE = re.compile(r'(?:src|href)="([^"]*_static/live/[^"]+)"')
WHOLE = re.compile(rf"{FIGURE}.*?</figure>", re.DOTALL)
TURNS = 20  # closed loops here and in the page, in turn
LEARNERS = ("ES", "GES")  # whose whole runs are timed
MOVES, RADIUS = 150, 25  # of the pointer while it drags [pixels]
EXAMPLES = 1000  # that the network remembers
FITS = 20  # that are timed together: a page's clock is coarse
WAIT = 30_000  # for a figure [ms]

# Notes when the first figure has drawn something, and how long every frame takes that draws anew.
CLOCK = """
  window.bench = { frames: [], first: null }
  const drawn = () => [...document.querySelectorAll("figure.live")].map((figure) => figure.shown)
  const real = window.requestAnimationFrame
  window.requestAnimationFrame = (call) => real((now) => {
    const before = drawn(), began = performance.now()
    call(now)
    document.body.getBoundingClientRect() // lays out
    const took = performance.now() - began
    if (drawn().some((each, i) => each !== before[i])) window.bench.frames.push(took)
  })
  const look = () => {
    if (drawn().some(Boolean)) window.bench.first = performance.now()
    else setTimeout(look)
  }
  document.addEventListener("DOMContentLoaded", look)
"""
FIRST = """() => window.bench.first - performance.getEntriesByType("navigation")[0].loadEventEnd"""
GIVEN = "figure.live script[type='application/json']"
DATA = f"""JSON.parse(document.querySelector("{GIVEN}").textContent)"""
SOLVER = f"""async () => {{
  const data = {DATA}, {{ problem, start, target, theta, horizon = 10 }} = data
  window.given = {{ start, target: target ?? problem.target, theta, horizon, discs: problem.discs }}
  window.nmpc = await window.nmpcrl.solver(window.nmpcrl.module, problem)
}}"""
LOOP = """(steps) => {
  const began = performance.now()
  const { failed } = window.nmpc.rollout(window.given, steps)
  if (failed) throw new Error("a solve failed")
  return (performance.now() - began) / steps
}"""
TRAIN = f"""([learner, layout, episodes]) => new Promise((done, failed) => {{
  const data = {DATA}, {{ problem, theta, w, steps, start, target, widths }} = data
  const of = Object.fromEntries(data.fields.map((field) => [field.name, field.default]))
  const settings = {{
    ...of, learner, episodes, steps, theta, w, start, target, seed: 0, decayRate: of.decay_rate,
    thetaSet: data.theta_set, evaluateEvery: data.evaluate_every, limits: data.limits,
    network: data.network,
    discs: data.layouts[layout].map((centre) => [...centre, data.clearance]),
  }}
  const began = performance.now(), module = window.nmpcrl.module
  const end = (why) => why ? failed(why) : done((performance.now() - began) / 1000)
  window.nmpcrl.trainer({{ module, problem, settings, widths }}, {{ row() {{}}, end }})
}})"""

FIT = f"""async ([turns, fits]) => {{
  const {{ solver, module, network, generator }} = window.nmpcrl
  const data = {DATA}, {{ problem, theta }} = data
  const {{ wasm }} = await solver(module, problem)
  const inputs = problem.target.length + problem.lower.length + theta.length
  const sizes = {{ inputs, ...data.network, capacity: {EXAMPLES}, rate: 0.01 }}
  const one = network(wasm, sizes, generator(0))
  for (let k = 0; k < {EXAMPLES}; k++) {{
    one.remember(Array.from({{ length: inputs }}, (_, i) => Math.sin(k * (i + 1))), k)
  }}
  return Array.from({{ length: turns }}, () => {{
    const began = performance.now()
    for (let k = 0; k < fits; k++) one.fit()
    return (performance.now() - began) / fits
  }})
}}"""


def measure(site: Path = SITE) -> Live:
    """Measure everything that there is a page for, and store it.

    Raises:
        Refusal: there is no built book with live figures, no Chromium or no playwright.
    """
    pages = pages_of(site)
    found: Live = {"date": datetime.now(UTC).date().isoformat()}
    found["weights"] = {page.name: weight(page) for page in pages}
    with chromium() as browser:
        visits = {page.name: visit(browser, page) for page in pages}
        for name in ("first", "requests", "errors"):
            found[name] = {page: one[name] for page, one in visits.items()}
        chapter = next((page for page in pages if page.name != LABORATORY), None)
        if chapter:
            found |= in_turn(browser, chapter) | {"drag": dragged(browser, chapter)}
        laboratory = site / "book" / LABORATORY
        if laboratory in pages:
            found["fit"] = fitted(browser, laboratory)
            found["runs"] = {one: trained(browser, laboratory, one) for one in LEARNERS}
    write_json(path(), found)
    return found


def stored() -> Live:
    """What was measured last, or nothing."""
    try:
        return dict(json.loads(path().read_text("utf-8")))
    except (OSError, ValueError):
        return {}


def path() -> Path:
    """The file, in the folder of the runs."""
    return folder() / "live.json"


def pages_of(site: Path) -> list[Path]:
    """The pages that have live figures.

    Raises:
        Refusal: there are none.
    """
    pages = [page for page in sorted(site.glob("book/*.html")) if FIGURE in page.read_text("utf-8")]
    if not pages:
        raise Refusal(f"no page with a live figure is built in {site}; `make book` builds them")
    return pages


def weight(page: Path) -> int:
    """How many bytes the live figures add to a page: what is in it, and the files it needs."""
    text = page.read_text("utf-8")
    files = {(page.parent / one.partition("?")[0]).resolve() for one in FILE.findall(text)}
    inside = sum(len(one.encode()) for one in WHOLE.findall(text))
    return int(inside + sum(one.stat().st_size for one in files))


@contextmanager
def chromium() -> Iterator[Any]:
    """A headless Chromium.

    Raises:
        Refusal: there is none, or no playwright to operate it.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise Refusal(
            "the live figures are measured with playwright, which is not installed"
        ) from None
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        raise Refusal(f"the live figures are measured in Chromium: none of {', '.join(BROWSERS)}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


def opened(browser: Any, page: Path) -> Any:
    """A tab with a page whose first figure has drawn something."""
    tab = browser.new_page(viewport={"width": 1400, "height": 900})
    tab.add_init_script(CLOCK)
    tab.requests, tab.errors = [], []
    tab.on("request", lambda request: tab.requests.append(request.url))
    tab.on("pageerror", lambda error: tab.errors.append(str(error)))
    tab.on("console", lambda said: tab.errors.append(said.text) if said.type == "error" else None)
    tab.goto(page.resolve().as_uri())
    tab.locator("figure.live").first.scroll_into_view_if_needed()
    tab.wait_for_function("() => window.bench.first !== null", timeout=WAIT)
    return tab


def visit(browser: Any, page: Path) -> dict[str, float]:
    """How long a figure takes to work after the load event [ms], and what the page asks for."""
    tab = opened(browser, page)
    outside = [url for url in tab.requests if not url.startswith(("file:", "data:", "blob:"))]
    first = max(0.0, float(tab.evaluate(FIRST)))
    tab.close()
    return {"first": first, "requests": len(outside), "errors": len(tab.errors)}


def in_turn(browser: Any, page: Path) -> Live:
    """A warm solve in the page and here, in turn: medians over a closed loop [us], `TURNS` each."""
    tab, (nmpc, seconds) = opened(browser, page), watched()
    tab.evaluate(SOLVER)
    times: dict[str, list[float]] = {"page": [], "native": []}
    for _ in range(TURNS + 1):
        times["page"].append(1e3 * tab.evaluate(LOOP, paper.STEPS))
        before = len(seconds)
        for _ in closed_loop(nmpc, 0.0, np.random.default_rng(0), paper.STEPS):
            pass
        times["native"].append(1e6 * float(np.mean(seconds[before:])))
    tab.close()
    return {name: values[1:] for name, values in times.items()}  # the first compile


def dragged(browser: Any, page: Path) -> list[float]:
    """How long each frame takes that replans and draws while the first handle is dragged [ms]."""
    tab = opened(browser, page)
    handle = tab.locator("figure.live svg [role=slider]").first
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.evaluate("window.bench.frames = []")
    for turn in np.linspace(0, 2 * np.pi, MOVES):
        tab.mouse.move(x + RADIUS * np.sin(turn), y + RADIUS * (1 - np.cos(turn)))
    tab.mouse.up()
    frames: list[float] = tab.evaluate("window.bench.frames")
    tab.close()
    return frames


def fitted(browser: Any, page: Path) -> list[float]:
    """How long a fit of RDES's network takes in the laboratory [ms], means of `FITS` at a time."""
    tab = opened(browser, page)
    times: list[float] = tab.evaluate(FIT, [TURNS + 1, FITS])
    tab.close()
    return times[1:]  # the first compile


def trained(browser: Any, page: Path, learner: str) -> dict[str, float]:
    """How long a whole run takes in the laboratory's worker and here [s]."""
    tab = opened(browser, page)
    there = float(tab.evaluate(TRAIN, [learner, Experiment(learner).layout, paper.EPISODES]))
    tab.close()
    run(Experiment(learner, episodes=1))  # compiles
    began = time.perf_counter()
    run(Experiment(learner))
    return {"page": there, "native": time.perf_counter() - began}
