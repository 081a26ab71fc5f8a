"""The live figures, moved by pointer, keys and fingers: a page finds what Python finds."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from live_page import CHANGES, CHAPTERS, MOST, Tab, loaded
from visits import assert_figures_pass

from nmpcrl.analysis.encounters import judged
from nmpcrl.analysis.two_state import Chain, follow
from nmpcrl.claims import published
from nmpcrl.control import Obstacle
from nmpcrl.learning.learners import gradient_td, semi_gradient
from nmpcrl.learning.rollout import evaluate
from nmpcrl.report.live.figures import BEGIN, SCENE
from nmpcrl.report.live.learning import NARROW, WIDE
from nmpcrl.study import Experiment, moving, paper
from nmpcrl.study.moving import PERIOD, PREDICTORS, Straight

DESK = {"viewport": {"width": 1400, "height": 1000}}
TELEPHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
MARGIN = "theta c, tightens the obstacle constraint"
STEP = "h, step of the finite differences"
WALK = "d, distance of the robot from the nearest boundary, negative inside"
TRAINED = "runs.length && runs.every(one => !['waiting', 'training'].includes(one.state))"
STILL = "!given.learning"
PICTURE = "article img"
each_figure = pytest.mark.parametrize("figure", CHAPTERS)


@pytest.fixture
def opened(site, browser) -> Iterator[Callable[..., Tab]]:
    """Opens the page of a live figure as a reader with these settings would."""
    contexts = []

    def with_settings(figure, *, script="", clock=False, using=browser, **settings):
        contexts.append(using.new_context(**settings))
        page = contexts[-1].new_page()
        if clock:
            page.clock.install()
        if script:
            page.add_init_script(script)
        return Tab(page, site, figure)

    yield with_settings
    for context in contexts:
        context.close()


def controller(discs, horizon=paper.HORIZON):
    """The robot's controller among these obstacles, and its task."""
    obstacles = tuple(Obstacle(*disc[:2]) for disc in discs)
    return paper.controller(replace(paper.task("A"), obstacles=obstacles), horizon=horizon)


def by_python(given: dict):
    """The plan and the closed loop of what a page was asked."""
    nmpc = controller(given["discs"], given["horizon"])
    nmpc = paper.controller(
        replace(nmpc.task, start=np.array(given["start"])), horizon=given["horizon"]
    )
    theta = np.array(given["theta"])
    return nmpc.solve(nmpc.task.start, theta), evaluate(nmpc, theta, paper.STEPS)


# ---- One journey a figure


def the_controller(tab: Tab) -> None:
    """A drag, an arrow key, a slider and a click each move what they should, and V is Python's."""
    before = tab.shown()
    tab.drag("Obstacle 2", (20, -35))
    tab.drag("Robot, heading", (-20, 30))
    tab.press("Robot, start", "ArrowUp", "Shift+ArrowRight")
    tab.press(MARGIN, *["ArrowRight"] * 7)
    tab.press("N, steps planned", "ArrowRight", "ArrowRight", "ArrowRight")
    shown = tab.shown()
    given, found = shown["given"], shown["found"]
    assert (given["horizon"], given["theta"][8]) == (13, pytest.approx(0.071))
    assert given["start"][:2] == pytest.approx(paper.task("A").start[:2] + [0.5, 0.1])
    assert given["discs"][1][1] > before["given"]["discs"][1][1]
    plan, rollout = by_python(given)
    assert found["plan"]["value"] == pytest.approx(plan.value, rel=1e-9)
    assert sum(found["parts"].values()) == pytest.approx(plan.value)
    assert found["cost"] == pytest.approx(rollout.cost, rel=1e-6)
    np.testing.assert_allclose(found["states"], rollout.states, atol=1e-4)
    assert f"{plan.value:.1f}" in tab.said()
    tab.page.mouse.click(*tab.middle("Obstacle 2"))
    goal = tab.middle("Obstacle 2") + [0, 90]
    tab.page.mouse.click(*goal)
    tab.shown()
    np.testing.assert_allclose(tab.middle("Obstacle 2"), goal, atol=1)
    assert tab.click("Reset all") == before


def the_gradient(tab: Tab) -> None:
    """Envelope and differences are Python's; on a boundary the slope jumps by the slack's price."""
    tab.drag("Robot, start", (25, -12))
    shown = tab.press(STEP, *["ArrowRight"] * 3)
    given, chosen = shown["given"], shown["found"]["chosen"]
    nmpc, theta, state = controller(given["discs"]), np.array(given["theta"]), given["start"]
    h, state = chosen["step"], np.array(state)
    moved = [theta + sign * h * row for row in np.eye(9) for sign in (1, -1)]
    above, below = np.array([nmpc.solve(state, row).value for row in moved]).reshape(9, 2).T
    features = nmpc.solve(state, theta).features
    np.testing.assert_allclose(shown["found"]["plan"]["features"], features, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(chosen["central"], (above - below) / (2 * h), atol=1e-8 / h)
    for key, side in (("End", -1), ("Home", 1)):
        shown = tab.press(WALK, key)
        boundary, start = shown["found"]["boundary"], np.array(shown["given"]["start"])
        assert boundary["offset"] == pytest.approx(-0.1 * side)
        assert np.sign(nmpc.task.overlap(start).max() + theta[8]) == side
        slope = nmpc.solve(start, theta).features[8]
        assert shown["found"]["plan"]["features"][8] == pytest.approx(slope, abs=1e-4)
    assert shown["found"]["jump"] == pytest.approx(nmpc.slack_weight, abs=1)
    assert "mm inside the boundary" in tab.said()
    all_steps = tab.until("found.all")["found"]["all"]
    errors = [one["errors"]["central"] for one in all_steps]
    assert errors[0] > 5 * min(errors) < errors[-1]  # round-off, truncation


def the_chain(tab: Tab) -> None:
    """Its updates are the library's; keys, Step and Play go through them."""
    tab.press("alpha, step size of theta", "ArrowRight", "ArrowRight")
    shown = tab.press("gamma, discount", "ArrowLeft")
    alpha, beta, gamma = (shown["given"][name] for name in ("alpha", "beta", "gamma"))
    rules = {"ES": semi_gradient(alpha), "GES": gradient_td(alpha, beta, gamma)}
    for learner, rule in rules.items():
        path = [[now["theta"], now["w"]] for now in shown["found"][learner]]
        np.testing.assert_allclose(path, follow(Chain(gamma=gamma), rule, 120), rtol=1e-9)
    assert tab.click("Step")["given"]["at"] == 1
    assert f"{shown['found']['GES'][1]['theta']:.3f}" in tab.said()
    assert tab.press("Updates made", "ArrowRight")["given"]["at"] == 2
    tab.press("Updates made", "End", "ArrowLeft", "ArrowLeft")
    tab.click("Play")
    tab.until("given.at === 120")
    tab.press("beta, step size of w", "Home")
    assert abs(tab.shown()["found"]["GES"][-1]["theta"]) > 1e3  # too small a beta
    tab.figure.get_by_label("in both states in turn (on-policy)").check()
    assert abs(tab.shown()["found"]["ES"][-1]["theta"]) < 1


def the_published_runs(tab: Tab) -> None:
    """Every number is a published one; one layout's runs are loaded when they are asked for."""
    tab.choose(Learner="GES", Beside_it="TDC", Layout="D", Noise_decays="episode", Seed="7")
    shown = tab.until("given.seed === 7 && found.every(one => one.run)")
    known = published.load()
    assert [one["learner"] for one in shown["found"]] == ["GES", "TDC", "frozen"]
    for one in shown["found"]:
        run = known.summaries[Experiment(one["learner"], layout="D", decay="episode", seed=7)]
        np.testing.assert_array_equal(one["run"]["training"], run.episodes["cost"])
        assert one["theta"] == run.evaluations["theta"][-1].tolist()
        assert one["judged"] == run.evaluations["cost"][-1]
        assert one["cost"] == pytest.approx(one["judged"], rel=1e-3)
    scripts = tab.page.evaluate("[...document.scripts].map(one => one.src)")
    assert [one[-9:] for one in scripts if "/runs_" in one] == ["runs_D.js"]
    assert tab.press("Episode", "ArrowLeft", "ArrowLeft", "ArrowLeft")["given"]["episode"] == 297
    tab.press("Episode", "Home")
    assert "before training" in tab.said()
    tab.click("Play")
    tab.until("given.episode >= 3")
    held = tab.click("Pause")["given"]["episode"]
    assert tab.shown()["given"]["episode"] == held < 300
    tab.choose(Learner="DES", Beside_it="", Layout="A", Noise_decays="step", Seed="3")
    tab.press("Episode", "End")
    assert "this run was stopped before episode 300" in tab.said()


def the_moving_obstacles(tab: Tab) -> None:
    """A disc and the tip of its velocity are dragged, and both robots drive as in Python."""
    scale = tab.figure.locator("svg").first.evaluate("svg => svg.getScreenCTM().a")
    before = tab.shown()
    assert before["given"]["step"] == BEGIN
    assert before["given"]["movers"] == [[*one.centre, *one.velocity] for one in SCENE]
    tab.drag("Obstacle 2", (-60, 40))
    tab.drag("Obstacle 3, velocity", (4 * 0.2 * scale, 0))
    shown = tab.press("Obstacle 1, velocity", "ArrowDown", "ArrowRight")
    movers = shown["given"]["movers"]
    place = np.array(movers[1][:2]) + PERIOD * BEGIN * np.array(movers[1][2:])
    old = np.array(SCENE[1].centre) + PERIOD * BEGIN * np.array(SCENE[1].velocity)
    np.testing.assert_allclose(place - old, [-60 / scale, -40 / scale], atol=0.02)
    assert movers[2][2:] == pytest.approx([0.2, 0.0], abs=0.011)
    assert movers[0][2:] == pytest.approx([0.05, 0.25])
    motions = [Straight((x, y), (vx, vy)) for x, y, vx, vy in movers]
    for view, robot in shown["found"].items():
        around = moving.World(motions, PREDICTORS[view])
        found = judged(moving.controller(4), np.array(shown["given"]["theta"]), around)
        assert robot["costs"][-1] == pytest.approx(found.cost, rel=1e-6)
        assert robot["inside"][-1] == found.contacts.inside
    assert tab.press("Time", "Home")["found"] == shown["found"]
    assert f"cost {shown['found']['frozen']['costs'][0]:.0f} so far" in tab.said()
    assert tab.click("Reset all") == before
    assert tab.press(MARGIN, *["ArrowRight"] * 25)["found"]["frozen"]["inside"][-1] == 0


def the_introduction(tab: Tab) -> None:
    """ES costs less where gaps are wide, is stuck where it closes one, and stops when asked."""
    begin = tab.shown()
    layouts = {name: [list(one) for one in paper.LAYOUTS[name]] for name in (WIDE, NARROW)}
    centres = [disc[:2] for disc in begin["given"]["discs"]]
    assert centres == layouts[WIDE]
    moved = tab.press("Obstacle 2", "Shift+ArrowUp")
    assert moved["found"]["now"]["cost"] == pytest.approx(by_python(moved["given"])[1].cost)
    tab.press("Obstacle 2", "Shift+ArrowDown")
    tab.click("Learn")
    tab.until("given.learning && given.episode > 2")
    stopped = tab.click("Stop")["given"]
    assert stopped["episode"] < 300
    tab.click("Learn")
    after = tab.until(f"{STILL} && given.episode === 300")
    assert after["found"]["now"]["arrived"]
    assert after["found"]["now"]["cost"] < 0.95 * begin["found"]["now"]["cost"]
    assert after["found"]["now"]["cost"] == pytest.approx(by_python(after["given"])[1].cost, 1e-6)
    radius = float(tab.figure.locator("circle.kept").first.get_attribute("r"))
    clearance = after["given"]["discs"][0][2]
    assert radius == pytest.approx(clearance / 2 * (1 + after["given"]["theta"][8]) ** 0.5)
    narrow = tab.click("Narrow a gap")
    assert [disc[:2] for disc in narrow["given"]["discs"]] == layouts[NARROW]
    tab.click("Learn")
    closed = tab.until(f"{STILL} && given.episode === 300")
    assert not closed["found"]["now"]["arrived"]
    assert closed["found"]["now"]["cost"] > 1.2 * narrow["found"]["now"]["cost"]
    assert "is stuck before the target" in tab.said()
    assert tab.click("Widen it again") == begin


def the_laboratory(tab: Tab) -> None:
    """Places and settings are moved, two learners train, and the last theta drives as in Python."""
    before = tab.shown()["given"]
    tab.click("Add an obstacle")
    tab.drag("Obstacle 5", (-30, 40))
    tab.press("Obstacle 2", "Delete")
    tab.press("Robot, start", "ArrowUp", "ArrowRight")
    tab.drag("Target", (-40, -20))
    tab.fill(Horizon_N="41")
    assert "Horizon N: a whole number from 1 to 40, please." in tab.said()
    tab.fill(Horizon_N="9", Episodes=5, Step_size_α="2e-7")
    given = tab.shown()["given"]
    assert given["layout"][0] == before["layout"][0]
    assert (len(given["layout"]), given["horizon"], given["alpha"]) == (4, 9, 2e-7)
    tab.click("Train")
    tab.choose(Learner="GES")
    tab.click("Train")
    first, second = tab.until(TRAINED)["runs"]
    assert [one["given"]["learner"] for one in (first, second)] == ["ES", "GES"]
    asked = {name: first["given"][name] for name in ("layout", "start", "target", "horizon")}
    experiment = Experiment(**asked)
    nmpc = paper.controller(experiment.task, horizon=9)
    for one in (first, second):
        last = one["rows"][-1]
        found = evaluate(nmpc, np.array(last["theta"]), paper.STEPS)
        assert last["judged"]["cost"] == pytest.approx(found.cost, rel=1e-6)
    command = tab.figure.get_by_label("The same settings in Python").input_value()
    assert "--learner GES" in command
    assert "--horizon 9" in command
    assert tab.figure.get_by_role("listitem").count() == 2
    link = tab.figure.get_by_label("A link to these settings").input_value()
    kept = tab.shown()["given"]
    tab.click("Reset all")
    tab.page.wait_for_function("() => !location.hash.includes('GES')")
    tab.page.evaluate("link => { location.hash = new URL(link).hash }", link)
    assert tab.until("given.learner === 'GES'")["given"] == kept
    tab.page.evaluate("location.hash = 'horizon=7&colour=red'")
    tab.figure.get_by_text("No setting has this name").wait_for()
    assert tab.shown()["given"] == kept


JOURNEYS = {
    "controller": the_controller,
    "gradient": the_gradient,
    "chain": the_chain,
    "runs": the_published_runs,
    "moving": the_moving_obstacles,
    "intro": the_introduction,
    "laboratory": the_laboratory,
}


def assert_journey(tab: Tab, figure: str) -> None:
    JOURNEYS[figure](tab.begun())
    assert tab.errors == []
    assert tab.external() == []


@each_figure
def test_a_figure_does_what_python_does(opened, figure):
    assert_journey(opened(figure, **DESK), figure)


@each_figure
def test_a_figure_does_so_in_firefox(opened, distributed_firefox, figure):
    assert_journey(opened(figure, using=distributed_firefox, **DESK), figure)


# ---- Whoever reads it: a finger, no motion, no script, no WebAssembly, paper, axe


DRAGS = {"intro": 2, "controller": 3, "gradient": 2, "moving": 2, "laboratory": 1}


@each_figure
def test_on_a_telephone_in_the_dark(opened, figure):
    """A finger moves an obstacle, hits each target, and scrolls past sliders; axe is content."""
    tab = opened(figure, reduced_motion="reduce", **TELEPHONE).begun()
    before = tab.shown()
    if figure in DRAGS:
        name = f"Obstacle {DRAGS[figure]}"
        place = tab.middle(name)
        tab.swipe(place, (0, 30))
        assert tab.shown()["given"] != before["given"]
        assert tab.middle(name)[0] == pytest.approx(place[0], abs=2)
    for slider in tab.figure.locator("label input[type=range]").all()[:1]:
        slider.evaluate("one => one.scrollIntoView({block: 'center'})")
        held, box = tab.shown()["given"], slider.bounding_box()
        track = (box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2)  # off the thumb
        tab.swipe(track, (0, -160), steps=8)
        assert tab.shown()["given"] == held
    for target in tab.figure.locator(
        ":is(.reach, input:not([type=radio]), label:has([type=radio]), button, select):visible"
    ).all():
        box = target.bounding_box()
        assert min(box["width"], box["height"]) >= 24
    tab.figure.locator("[role=status][aria-busy=false]").wait_for()
    assert_figures_pass(tab.page, 390)


@each_figure
def test_nothing_moves_by_itself(opened, figure):
    tab = opened(figure, clock=True).begun()
    tab.said()
    tab.figure.evaluate(CHANGES)
    tab.page.clock.run_for(2000)
    tab.shown()
    assert tab.page.evaluate("window.changes") == 0


@each_figure
def test_without_script_and_on_paper_there_are_the_pictures_alone(opened, figure):
    for tab in (opened(figure, java_script_enabled=False), opened(figure).begun()):
        tab.page.emulate_media(media="print")
        pictures = tab.page.locator(PICTURE).all()
        assert pictures
        assert all(one.is_visible() for one in pictures)
        assert not tab.figure.is_visible()


@each_figure
def test_without_webassembly_there_is_a_sentence(opened, figure):
    tab = opened(figure, script="delete window.WebAssembly")
    tab.figure.get_by_text("does not run WebAssembly").wait_for()
    assert tab.page.locator(PICTURE).first.is_visible()
    assert tab.errors == []


def test_the_robot_of_the_introduction_is_on_the_first_screen(opened):
    for settings in (TELEPHONE, {"viewport": {"width": 1280, "height": 800}}):
        tab = opened("intro", **settings).begun()
        bottom = tab.figure.locator("svg").first.evaluate(
            "one => one.getBoundingClientRect().bottom"
        )
        assert bottom < settings["viewport"]["height"]
        assert not tab.page.locator(PICTURE).first.is_visible()


def test_training_that_fails_says_why(opened):
    tab = opened("laboratory").begun()
    tab.page.evaluate("window.nmpcrl.module = 'AAAA'")
    tab.click("Train")
    tab.figure.get_by_text("this browser could not train: ").wait_for()


def test_only_a_page_with_a_live_figure_loads_its_light_scripts(site):
    pages = {path.stem for path in site.glob("book/*.html") if "_static/live/" in path.read_text()}
    assert pages == {*CHAPTERS.values()}
    assert all(loaded(site, figure) <= MOST for figure in CHAPTERS)


# ---- Algorithm 1 in a page


RUN = """async ({ module, problem, settings, noise }) => {
  const nmpc = await window.nmpcrl.solver(module, problem)
  return Array.from(window.nmpcrl.run(nmpc, settings, noise))
}"""


@pytest.mark.parametrize("learner", ["ES", "GES", "TDC", "QL", "frozen", "DES", "RDES"])
def test_with_the_same_noise_a_page_learns_what_python_learns(browser, robot_module, learner):
    """To the first fit of a network, whose first weights are drawn otherwise."""
    import gzip
    from base64 import b64encode

    from nmpcrl.report.live import frame
    from nmpcrl.report.live.learning import FIXED
    from nmpcrl.report.live.problem import problem_of
    from nmpcrl.report.prose import ROOT
    from nmpcrl.study import run

    network = learner in ("DES", "RDES")
    experiment = Experiment(learner, episodes=3, steps=paper.BATCH - 1 if network else paper.STEPS)
    experiment = replace(experiment, episodes=1) if network else experiment
    nmpc, records = paper.nmpc("A"), run(experiment)
    draw = np.random.default_rng(np.random.SeedSequence(experiment.seed).spawn(3)[0])
    noise = draw.normal(scale=paper.NOISE, size=(experiment.episodes, experiment.steps, 2))
    settings = FIXED | {
        "learner": learner, "alpha": experiment.alpha, "zeta": experiment.zeta, "seed": 0,
        "beta": experiment.beta_tdc if learner == "TDC" else experiment.beta,
        "decay": experiment.decay, "decayRate": experiment.decay_rate, "thetaSet": paper.THETA_SET,
        "episodes": experiment.episodes, "steps": experiment.steps, "evaluateEvery": 1,
        "theta": experiment.theta, "start": paper.START, "target": paper.TARGET,
        "discs": np.transpose(nmpc.task.discs).tolist(), "horizon": nmpc.horizon,
    }  # fmt: skip
    page = browser.new_page()
    for name in (frame.SHARED[0], "learning.js"):
        page.add_script_tag(content=(ROOT / "book/_static/live" / name).read_text("utf-8"))
    module = b64encode(gzip.compress(robot_module)).decode()
    given = {"module": module, "problem": problem_of(nmpc), "settings": settings}
    rows = page.evaluate(RUN, given | {"noise": noise.ravel().tolist()})[1:]
    page.close()
    last = np.flatnonzero(np.append(np.diff(records.steps["episode"]), 1))
    theta, expected = np.array([row["theta"] for row in rows]), records.steps["theta"][last]
    np.testing.assert_allclose(theta, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    costs = np.add.reduceat(records.steps["cost"], np.append(0, last[:-1] + 1))
    np.testing.assert_allclose([row["cost"] for row in rows], costs, rtol=1e-7)
