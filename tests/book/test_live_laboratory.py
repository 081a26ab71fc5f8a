"""The laboratory, with real pointer and key events: what it trains is what Python trains."""

import json
import re
import subprocess
import sys
from itertools import chain

import numpy as np
import pytest
from visits import assert_figures_pass

from nmpcrl.learning.rollout import evaluate
from nmpcrl.report import continuing
from nmpcrl.study import Experiment, paper, run
from nmpcrl.study.experiment import frozen_arm
from nmpcrl.study.setup import controller_of

FIGURE = "laboratory"
FINISHED = """() => {
  const { runs } = document.querySelector("figure.live").shown
  return runs.length && runs.every(run => ["finished", "diverged", "stopped"].includes(run.state))
}"""
GOING = """() => document.querySelector("figure.live").shown.runs[0]?.rows.length > 3"""
ARMS = """() => document.querySelector("figure.live").shown.runs.every(run => run.arm.length)"""
DRAWN = """([seed, count]) => {
  const { widths } = JSON.parse(document.querySelector("figure.live script").textContent)
  return Array.from(window.nmpcrl.normal(seed, count, widths))
}"""
DAMAGED = {  # and what is said to be allowed
    "learner=random": "one of ES, DES, RDES, GES, TDC, QL, frozen",
    "alpha=": "above 0", "alpha=0": "above 0", "alpha=%": "above 0",
    "seed=1.5": "a whole number from 0", "horizon=41": "a whole number from 1 to 40",
    "colour=red": "No setting", "{}=1": "No setting", "{b}=1": "No setting", "=1": "No setting",
    "constructor=1": "No setting", "theta=1,2": "9 numbers",
    "theta=1e9,1,1,1,1,1,1,1,1": "9 numbers from -1000000 to 1000000",
    "layout=1,2;3": "1 to 8 pairs", "layout=1,2,3": "1 to 8 pairs",
    "layout=" + ";".join(["0,0"] * 9): "1 to 8 pairs", "start=0,0": "x,y,heading",
    "target=8.5,20,0": "x,y,heading",
}  # fmt: skip
FAILS_ONCE = """learner => {
  const post = Worker.prototype.postMessage
  let failed = false
  Worker.prototype.postMessage = function (given) {
    const fails = !failed && given.settings.learner === learner
    failed ||= fails
    post.call(this, fails ? { ...given, module: "" } : given)
  }
}"""
ARMS_OF = """lengths => {
  const { runs } = document.querySelector("figure.live").shown
  return String(runs.map(run => run.arm.length)) === String(lengths)
}"""
LINKED = """() => document.querySelector("figure.live textarea").value === location.href"""
REFUSES = "Clipboard.prototype.writeText = async () => { throw new Error('refused') }"
HURRIES = """
  const later = window.setTimeout
  window.setTimeout = (done, due) => later(() => {
    const { hash } = location
    done()
    if (hash === location.hash || window.hurried) return
    window.hurried = true
    document.querySelector("figure.live .gallery button").click()
  }, due)"""  # begins the lesson in the very task in which the address changes
SLOW = """
  const post = Worker.prototype.postMessage
  Worker.prototype.postMessage = function (given) {
    post.call(this, { ...given, settings: { ...given.settings, episodes: 3000 } })
  }"""  # a run that is still going on when it is stopped


def fill(tab, **fields) -> None:
    """Write into fields and leave them."""
    for name, text in fields.items():
        field = tab.figure.get_by_label(name.replace("_", " "), exact=True).locator("visible=true")
        field.fill(str(text))
        field.press("Tab")


def choose(tab, name, value) -> None:
    tab.figure.get_by_label(name, exact=True).select_option(value)


def data_of(tab) -> dict:
    """What the page is given."""
    return json.loads(tab.figure.locator("script").first.text_content())


def trained(tab) -> list[dict]:
    """The runs, once all that was asked for is trained."""
    tab.page.wait_for_function(FINISHED)
    return tab.shown()["runs"]


def box(tab, label) -> str:
    """A text to take along."""
    return tab.figure.get_by_label(label, exact=True).input_value()


def settled(tab, old="") -> str:
    """The address, once it has another fragment."""
    tab.page.wait_for_function("old => location.hash !== old", arg=old)
    return tab.page.evaluate("location.hash")


def assert_equal_to_python(found: dict, experiment: Experiment, digits: float = 1e-9) -> None:
    """theta after every episode, and both costs."""
    expected, rows = run(experiment), found["rows"]
    steps, judged = expected.steps, expected.evaluations
    last = np.flatnonzero(np.append(np.diff(steps["episode"]), 1))
    theta = np.array([row["theta"] for row in rows[1:]])
    assert theta.shape == (experiment.episodes, 9)
    assert np.abs(theta - steps["theta"][last]).max() < digits * np.abs(steps["theta"]).max()
    costs = [row["judged"]["cost"] for row in rows if row["judged"]]
    np.testing.assert_allclose(costs, judged["cost"], rtol=10 * digits)
    noisy = np.add.reduceat(steps["cost"], np.append(0, last[:-1] + 1))
    np.testing.assert_allclose([row["cost"] for row in rows[1:]], noisy, rtol=10 * digits)
    largest = np.maximum.reduceat(steps["alpha_phi2"], np.append(0, last[:-1] + 1))
    found_largest = [row["alphaPhi2"] for row in rows[1:]]
    np.testing.assert_allclose(found_largest, largest, rtol=100 * digits)
    assert_worth_as_in_python(rows, experiment, 100 * digits)


def assert_worth_as_in_python(rows: list[dict], experiment: Experiment, digits: float) -> None:
    """The TD error of each episode, and of each theta that was judged what its value says."""
    expected = run(experiment)
    episode, delta = expected.steps["episode"], expected.steps["delta"]
    for row in rows[1:]:
        here = delta[(episode == row["episode"] - 1) & np.isfinite(delta)]
        if here.size:
            np.testing.assert_allclose(row["delta"], np.sqrt(np.mean(here**2)), rtol=digits)
    controller = controller_of(experiment)
    for row in (row for row in rows if row["judged"]):
        theta = np.array(row["theta"])
        rollout = evaluate(controller, theta, experiment.steps)
        pairs = zip(rollout.states, rollout.actions, strict=False)
        costs = [experiment.task.stage_cost(state, action) for state, action in pairs]
        discounted = np.sum(paper.GAMMA ** np.arange(len(costs)) * costs)
        np.testing.assert_allclose(row["judged"]["discounted"], discounted, rtol=digits)
        value = controller.solve(experiment.task.start, theta).value
        np.testing.assert_allclose(row["judged"]["value"], value, rtol=digits)


def assert_command(tab, experiment: Experiment) -> None:
    """The page's command is the library's, but for the order and digits of its options."""
    words = box(tab, "Command of the same run").split(" \\\n")
    wanted = re.sub(r"(?<=e-)0|\.0\b", "", continuing.command(experiment)).split(" \\\n")
    assert sorted(words) == sorted(wanted)


def test_noise_is_that_of_numpy(tab):
    """In every bit; the tail to the digits in which one machine's logarithm is another's."""
    tails = 0  # a seed has none in 1 of 150
    for seed in (0, 7, 2**31 - 1, np.random.default_rng().integers(2**31)):
        found = np.array(tab.page.evaluate(DRAWN, [int(seed), 20_000]))
        generator = np.random.default_rng(np.random.SeedSequence(int(seed)).spawn(3)[0])
        expected = generator.normal(scale=1.0, size=20_000)
        tail = np.abs(expected) > 3.6541
        tails += tail.sum()
        assert (found == expected)[~tail].all()
        np.testing.assert_allclose(found, expected, rtol=1e-15)
    assert tails


def test_twenty_episodes_of_each_learner_are_those_of_python(tab):
    fill(tab, Episodes=20)
    experiments = [
        Experiment(learner="ES", episodes=20),
        Experiment(learner="GES", decay="episode", decay_rate=0.97, episodes=20),
        Experiment(learner="TDC", seed=3, episodes=20),  # where every product can be formed
        Experiment(learner="QL", episodes=20),
    ]
    for one in experiments:
        choose(tab, "Learner", one.learner)
        choose(tab, "Decay per", one.decay)
        fill(tab, Seed=one.seed, Decay_factor_c=one.decay_rate, Horizon_N=one.horizon)
        tab.click("Train")
    for found, one in zip(trained(tab), experiments, strict=True):
        assert_equal_to_python(found, one, 1e-11 if one.learner in ("ES", "GES") else 1e-8)
        text = tab.figure.get_by_role("listitem").nth(found["number"] - 1).inner_text()
        assert f"noise-free cost {run(one).facts['final_cost']:.1f}" in text


def test_a_network_is_fitted_as_in_python(tab):
    """To single precision, in which nothing has grown yet after five episodes."""
    fill(tab, Episodes=5)
    experiments = [
        Experiment(learner="DES", seed=2, episodes=5),
        Experiment(learner="RDES", decay="episode", zeta=3e-3, episodes=5),
    ]
    assert not tab.figure.get_by_label("Learning rate ζ").is_visible()
    for one in experiments:
        choose(tab, "Learner", one.learner)
        choose(tab, "Decay per", one.decay)
        fill(tab, Seed=one.seed, Learning_rate_ζ=one.zeta)
        tab.click("Train")
        assert_command(tab, one)
    for found, one in zip(trained(tab), experiments, strict=True):
        assert_equal_to_python(found, one, 1e-5)
    assert "up to the network’s first fit" in tab.figure.inner_text()
    choose(tab, "Learner", "ES")
    tab.shown()  # the note follows with the next frame
    assert "first fit" not in tab.figure.inner_text()


def test_a_layout_that_is_drawn_is_the_same_run_in_python(tab):
    tab.drag("Obstacle 2", (15, -30))
    tab.click("Add an obstacle")
    tab.drag("Target", (-40, -20))
    tab.press("Robot, start", "ArrowUp", "ArrowUp", "ArrowRight")
    tab.press("Target, heading", "ArrowRight")
    choose(tab, "Learner", "GES")
    fill(tab, Step_size_α="2e-7", Episodes=5)
    given = tab.shown()["given"]
    assert len(given["layout"]) == 5
    places = *given["layout"], given["start"], given["target"][:2]
    for number in chain.from_iterable(places):
        assert number == round(number, 2)
    tab.click("Train")
    names = ("learner", "alpha", "layout", "start", "target", "episodes")
    experiment = Experiment(**{name: given[name] for name in names})
    assert_equal_to_python(trained(tab)[0], experiment)
    shown: dict = {}
    exec(box(tab, "Library code of the same run"), shown)  # which trains
    assert shown["experiment"] == experiment
    assert_command(tab, experiment)


def test_a_paste_into_a_terminal_trains_the_same_run(tab, tmp_path):
    tab.press("Obstacle 4", "ArrowUp")
    fill(tab, Episodes=2, Seed=5)
    tab.click("Train")
    cost = trained(tab)[0]["rows"][-1]["judged"]["cost"]
    words = box(tab, "Command of the same run").replace("nmpcrl", f"{sys.executable} -m nmpcrl")
    environment = {"NMPCRL_RUNS": str(tmp_path), "NMPCRL_WARNED": "1"}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        said = subprocess.run(words, shell=True, capture_output=True, text=True, check=True)
    assert f"noise-free cost {cost:.1f}" in said.stdout + said.stderr


def test_the_frozen_arm_meets_the_same_noise(tab):
    fill(tab, Episodes=3, Seed=4)
    tab.click("Train")
    trained(tab)
    tab.page.wait_for_function(ARMS)
    tab.figure.locator("progress").wait_for(state="hidden")
    arm = tab.shown()["runs"][0]["arm"]
    expected = run(frozen_arm(Experiment(episodes=3, seed=4))).steps["cost"].reshape(3, -1)
    np.testing.assert_allclose([row["cost"] for row in arm[1:]], expected.sum(axis=1), rtol=1e-9)


def test_obstacles_come_and_go_by_mouse_and_by_key(tab):
    before = tab.shown()["given"]["layout"]
    tab.click("Add an obstacle")
    tab.drag("Obstacle 5", (-30, 40))
    assert tab.shown()["given"]["layout"][:4] == before
    tab.press("Obstacle 2", "Delete")
    assert tab.page.evaluate("document.activeElement.ariaLabel") == "Obstacle 1"
    layout = tab.shown()["given"]["layout"]
    assert layout[:3] == [before[0], *before[2:]]
    for name, count in (("Add an obstacle", 8), ("Remove the last one", 1)):
        button = tab.figure.get_by_role("button", name=name)
        button.focus()
        for _ in range(8):
            tab.page.keyboard.press("Enter")
        assert len(tab.shown()["given"]["layout"]) == count
        assert button.get_attribute("aria-disabled") == "true"
    assert tab.shown()["given"]["layout"] == before[:1]
    tab.press("Obstacle 1", "Delete")
    assert tab.shown()["given"]["layout"] == before[:1]
    tab.click("Reset all")
    assert tab.shown()["given"]["layout"] == before


def test_start_and_target_stay_in_the_box(tab):
    tab.press("Robot, start", *["Shift+ArrowLeft"] * 4)
    tab.press("Target", *["Shift+ArrowRight"] * 4)
    given = tab.shown()["given"]
    assert given["start"][0] == paper.LOWER[0]
    assert given["target"][0] == paper.UPPER[0]


def test_training_is_stopped_and_what_it_found_stays(opened):
    tab = opened(FIGURE, script=SLOW, viewport={"width": 1400, "height": 1000}).begun()
    tab.click("Train")
    tab.page.wait_for_function(GOING)
    tab.click("Stop")
    stopped = tab.shown()["runs"][0]
    assert stopped["state"] == "stopped"
    tab.later()
    assert len(tab.shown()["runs"][0]["rows"]) == len(stopped["rows"])
    assert "stopped" in tab.figure.get_by_role("listitem").inner_text()


def test_runs_share_the_plots_and_can_be_removed(tab):
    fill(tab, Episodes=2)
    tab.click("Train")
    choose(tab, "Learner", "GES")
    tab.click("3 other seeds")
    runs = trained(tab)
    tab.quiet()
    assert [one["given"]["seed"] for one in runs] == [0, 1, 2, 3]
    names = tab.figure.locator(".plots svg").first.locator("text.right")
    assert sorted(names.all_text_contents()) == ["1", "2", "3", "4"]
    tab.figure.get_by_role("radio", name="3: GES, seed 2").check()
    assert tab.shown()["given"]["seed"] == 2
    assert tab.shown()["last"] is not None
    tab.click("Remove 3: GES, seed 2, episodes 2")
    tab.page.wait_for_function("() => document.querySelectorAll('.runs li').length === 3")
    assert sorted(names.all_text_contents()) == ["1", "2", "4"]


def test_only_runs_in_the_chosen_place_share_the_plots(tab):
    fill(tab, Episodes=1)
    tab.click("Train")
    tab.press("Obstacle 1", "ArrowUp")
    tab.click("Train")
    trained(tab)
    names = tab.quiet().figure.locator(".plots svg").first.locator("text.right")
    assert names.all_text_contents() == ["2"]
    tab.figure.get_by_role("radio", name="1: ES, seed 0, episodes 1").check()
    tab.later()
    assert names.all_text_contents() == ["1"]
    press(tab, "Lay 2: ES, seed 0, episodes 1, own places over the chosen one")
    tab.later()
    assert sorted(names.all_text_contents()) == ["1", "2"]


def test_on_a_telephone_the_plots_of_a_step_stand_right_below_it(opened):
    tab = opened(FIGURE, viewport={"width": 390, "height": 844}, reduced_motion="reduce").begun()
    tab.click("Lesson: the trap")
    told(tab)
    parts = (tab.figure.locator(part).first for part in (".told", ".panel.look", ".side"))
    text, plot, map_ = (part.bounding_box()["y"] for part in parts)
    assert text < plot < map_
    assert plot - text < 500


def test_a_link_restores_everything_and_the_browsers_arrows_lead_back(tab, opened):
    tab.press("Obstacle 1", "Shift+ArrowDown")
    first = settled(tab)
    choose(tab, "Learner", "TDC")
    fill(tab, Seed=9, Step_size_β="3e-7")
    tab.press("Target, heading", "ArrowLeft")
    settled(tab, first)
    tab.page.wait_for_function(LINKED)
    link, given = box(tab, "A link to these settings"), tab.shown()["given"]
    assert link == tab.page.url
    other = opened(FIGURE).begun()
    other.page.goto("about:blank")
    other.page.goto(link)
    other.begun()
    assert other.shown()["given"] == given
    last = tab.page.evaluate("location.hash")
    lead(tab, tab.page.go_back, first)
    back = tab.shown()["given"]
    assert [back["learner"], back["seed"], back["layout"]] == ["ES", 0, given["layout"]]
    lead(tab, tab.page.go_forward, last)
    assert tab.shown()["given"] == given


def lead(tab, turn, to: str) -> None:
    """Press an arrow of the browser until the address is there: a slow hand left several behind."""
    for _ in range(tab.page.evaluate("history.length")):
        turn()
        if tab.page.evaluate("location.hash") == to:
            return
    pytest.fail(f"the arrows never lead to {to}")


def test_a_link_that_is_not_read_gets_a_sentence_and_what_is_set_stays(tab):
    said = tab.figure.locator(".results")
    fill(tab, Seed=4)
    given = tab.shown()["given"]
    for fragment, allowed in DAMAGED.items():
        tab.page.evaluate("text => { location.hash = text }", f"horizon=7&{fragment}")
        said.get_by_text(f"it says “{fragment}”").wait_for()
        assert allowed in said.inner_text()
        assert tab.shown()["given"] == given
        tab.page.wait_for_function("() => location.hash.includes('seed=4')")
        tab.press("Obstacle 1", "ArrowUp", "ArrowDown")
        said.get_by_text("not read").wait_for(state="hidden")


def test_a_number_that_makes_no_sense_is_refused_beside_its_field(tab):
    fill(tab, Horizon_N="41")
    assert "Horizon N: a whole number from 1 to 40, please." in tab.quiet().figure.inner_text()
    assert tab.figure.get_by_label("Horizon N").get_attribute("aria-invalid") == "true"
    assert tab.shown()["given"]["horizon"] == paper.HORIZON
    fill(tab, Horizon_N="12")
    assert tab.shown()["given"]["horizon"] == 12
    assert "please" not in tab.quiet().figure.inner_text()


def press(tab, button) -> None:
    """A button by keyboard."""
    tab.figure.get_by_role("button", name=button, exact=True).focus()
    tab.page.keyboard.press("Enter")


def told(tab) -> str:
    """What a find or a step says, once what it trains has ended."""
    outcome = tab.figure.locator(".told .outcome")
    outcome.filter(has_text=re.compile(".")).wait_for()
    return outcome.inner_text()


def test_what_is_clicked_while_the_address_changes_stays(opened):
    tab = opened(FIGURE, script=HURRIES).begun()
    fill(tab, Episodes=1)
    tab.page.wait_for_function("() => window.hurried")
    assert "learns here" in tab.figure.locator(".told").inner_text()
    assert told(tab)


def assert_played(tab) -> None:
    """That the robots drive to the end of their time, which they once had left."""
    tab.page.wait_for_function(
        """() => {
          const range = document.querySelector("figure.live .player input")
          window.driven = window.driven || range.value < 100
          return window.driven && range.value === range.max
        }"""
    )


def test_it_is_the_first_thing_on_its_page_and_as_wide_as_the_window(opened):
    tab = opened(FIGURE, viewport={"width": 1280, "height": 800}).begun()
    whole, plot = tab.figure.bounding_box(), tab.figure.locator(".curves").bounding_box()
    assert whole["y"] < 200
    assert whole["width"] > 1150
    before = "one => one.compareDocumentPosition(document.querySelector('figure.live')) & 4"
    above = tab.page.locator("article :is(img, figure, .highlight)")
    assert not [one for one in above.all() if one.evaluate(before) and one.is_visible()]
    sides = tab.page.locator(".bd-sidebar-primary"), tab.page.locator(".bd-sidebar-secondary")
    assert not any(side.is_visible() for side in sides)
    map_ = tab.figure.locator("svg").first.bounding_box()
    assert map_["x"] + map_["width"] <= plot["x"]
    assert abs(plot["y"] - map_["y"]) < map_["height"] / 2
    tab.page.locator(".primary-toggle").click()
    sides[0].wait_for()
    assert not sides[1].is_visible()


def test_on_a_telephone_the_curves_follow_the_map(opened):
    tab = opened(FIGURE, viewport={"width": 390, "height": 844}).begun()
    map_, plot = (tab.figure.locator(one).first.bounding_box() for one in ("svg", ".curves"))
    assert map_["y"] + map_["height"] <= plot["y"]
    assert map_["width"] > 300
    assert map_["y"] < 844
    assert tab.page.evaluate("document.documentElement.scrollWidth") <= 390


def test_before_a_run_a_sentence_stands_where_the_curves_will(tab):
    hint, plots = tab.figure.locator(".curves .hint"), tab.figure.locator(".plots")
    assert hint.is_visible()
    assert not plots.is_visible()
    fill(tab, Episodes=2)
    tab.click("Train")
    trained(tab)
    assert plots.is_visible()
    assert not hint.is_visible()


def test_a_find_fills_the_form_trains_and_says_what_to_look_at(tab):
    buttons = tab.figure.locator(".gallery button")
    finds = {find["title"]: find for find in data_of(tab)["gallery"]}
    assert buttons.all_inner_texts() == ["Lesson: the trap", *finds]
    for name, find in finds.items():
        press(tab, name)
        said = f"{find['sentence']} {find['look']}".replace("{c}", "θc")
        assert tab.figure.locator(".told p").nth(1).inner_text() == said
        tab.page.wait_for_function("() => document.querySelector('figure.live').shown.last")
        assert tab.shown()["given"] == find["settings"]
        asked = [find["settings"], *([find["against"]] if find["against"] else [])]
        of_find = [run["given"] for run in tab.shown()["runs"] if run["state"] != "stopped"]
        assert all(one in of_find for one in asked)
        assert tab.figure.locator(".runs [aria-pressed=true]").count() == len(asked) - 1
        assert_command(tab, Experiment(**find["settings"]))
    tab.click("Stop")
    tab.click("Reset all")
    assert tab.shown()["given"]["layout"] == [list(one) for one in paper.LAYOUTS["A"]]
    assert not tab.figure.locator(".told").is_visible()


@pytest.mark.weekly
def test_the_find_about_a_gap_shows_that_it_closes(tab):
    tab.click("A gap that closes")
    assert "does not arrive" in told(tab)
    assert_played(tab)
    shown = tab.shown()
    assert shown["runs"][0]["state"] == "finished"
    assert shown["last"]["cost"] > 1.5 * shown["first"]["cost"]
    tab.press("Obstacle 4", "ArrowDown")  # whoever moves something has left the find
    tab.shown()
    assert not tab.figure.locator(".told").is_visible()


@pytest.mark.weekly
def test_the_find_about_a_tie_lays_the_run_of_lower_cost_over_the_one_between_two_plans(tab):
    tab.click("A tie")
    tab.page.wait_for_function("() => document.querySelector('figure.live').shown.over")
    shown = tab.shown()
    assert shown["last"]["cost"] == shown["first"]["cost"]  # before anything is learned
    assert shown["last"]["cost"] > shown["over"]["cost"]
    told(tab)
    tab.figure.get_by_label("Policy").press("End")
    assert tab.shown()["last"]["cost"] != shown["last"]["cost"]


def test_a_run_is_laid_over_another(tab):
    fill(tab, Episodes=10)
    tab.click("Train")
    choose(tab, "Learner", "QL")
    tab.click("Train")
    runs = trained(tab)
    assert tab.shown()["over"] is None
    press(tab, "Lay 1: ES, seed 0, episodes 10 over the chosen one")
    tab.page.wait_for_function("() => document.querySelector('figure.live').shown.over")
    shown = tab.shown()
    costs = [run["rows"][-1]["judged"]["cost"] for run in runs]
    np.testing.assert_allclose([shown["over"]["cost"], shown["last"]["cost"]], costs)
    text = tab.quiet().figure.locator(".results").inner_text()
    assert f"laid over, with the last θ of run 1: cost {costs[0]:.1f}" in text
    kept = tab.figure.locator(".plots svg").first.locator("polyline.kept")
    assert kept.evaluate("one => getComputedStyle(one).strokeDasharray") == "7px, 4px"
    map_ = tab.figure.locator("svg").first
    assert map_.locator("polyline.over").get_attribute("points").count(",") == paper.STEPS
    press(tab, "Lay 1: ES, seed 0, episodes 10 over the chosen one")
    tab.page.wait_for_function("() => !document.querySelector('figure.live').shown.over")
    assert map_.locator("polyline.over").get_attribute("points") == ""


def test_the_robot_drives_at_the_speed_that_is_asked_for(tab):
    place = tab.figure.locator(".driven.loop")
    states = tab.shown()["first"]["states"]
    time = tab.figure.get_by_label("Time of the closed loop")
    for key, k in (("Home", 0), ("ArrowRight", 1), ("End", paper.STEPS - 1)):
        time.press(key)
        x, y = states[k][:2]
        moved = place.evaluate(
            "one => [one.transform.baseVal[0].matrix.e, one.transform.baseVal[0].matrix.f]"
        )
        np.testing.assert_allclose(moved, [x, y], atol=1e-6)
    assert time.get_attribute("aria-valuetext") == "25.8 s"
    tab.page.clock.install(time=0)
    tab.page.clock.pause_at(10)
    gone = {}
    for speed in (1, 16):
        time.press("Home")
        tab.figure.get_by_label("Speed of play").select_option(str(speed))
        tab.click("Play")
        tab.page.clock.run_for(1000)
        tab.click("Pause")
        gone[speed] = int(time.input_value())
    assert gone == {1: 5, 16: 80}  # steps of 0.2 s


def test_whoever_wants_no_motion_sees_the_end(opened):
    tab = opened(FIGURE, reduced_motion="reduce").begun()
    tab.click("A tie")
    tab.page.wait_for_function("() => document.querySelector('figure.live').shown.over")
    time = tab.figure.get_by_label("Time of the closed loop")
    assert time.input_value() == time.get_attribute("max")
    assert tab.figure.get_by_role("button", name="Pause").count() == 0


def test_every_policy_of_a_run_can_be_seen_again(tab):
    fill(tab, Episodes=20)
    tab.click("Train")
    (found,) = trained(tab)
    policy = tab.figure.get_by_label("Policy")
    judged = [row for row in found["rows"] if row["judged"]]
    for key, row in zip(("Home", "ArrowRight", "End"), judged, strict=True):
        policy.press(key)
        np.testing.assert_allclose(tab.shown()["last"]["cost"], row["judged"]["cost"])
    assert policy.get_attribute("aria-valuetext") == "after episode 20"


@pytest.mark.weekly
def test_the_lesson_on_the_trap_is_six_steps_that_run(tab):
    """By keyboard; the first step closes a gap by hand, the second by learning."""
    steps = data_of(tab)["trap"]
    press(tab, "Lesson: the trap")
    said = []
    for number, step in enumerate(steps, 1):
        if number > 1:
            press(tab, "Next")
        heading = tab.figure.locator(".told .plot-title").inner_text()
        assert heading.startswith(f"Step {number} of 6: ")
        said.append(told(tab))
        given = tab.shown()["given"]
        assert given == step["settings"]
        assert tab.figure.get_by_label("Seed", exact=True).input_value() == str(given["seed"])
        assert tab.figure.locator(".panel.look").count() >= 1
    by_hand, learned, value, slower, exact, low = said
    assert re.match(r"Without learning, with θc = 0\.100, the robot does not arrive", by_hand)
    assert "with θc = 0.001, the robot arrives" in by_hand
    assert "the robot does not arrive" in learned
    assert "The value got more accurate while the policy got worse" in value
    assert "closed after episode" in slower
    assert "The gap stays open" in exact
    assert "with θc = 0.050, the robot arrives" in low
    runs = tab.shown()["runs"]
    assert len(runs) == 6  # ES is trained once, and steps 1 and 6 have two more of theta_c
    assert tab.figure.get_by_role("button", name="Next").get_attribute("aria-disabled") == "true"
    press(tab, "Back")
    assert told(tab) == exact
    assert len(tab.shown()["runs"]) == 6


def test_a_find_about_a_network_fails_here_as_in_python_and_says_when(tab):
    tab.click("RDES fails, DES does not")
    tab.page.wait_for_function(
        "() => document.querySelector('figure.live').shown.runs[0]?.state === 'diverged'"
    )
    found, well = tab.shown()["runs"]
    assert well["given"] == {**found["given"], "learner": "DES"}
    expected, last = run(Experiment(**tab.shown()["given"])), found["rows"][-1]["episode"]
    assert found["state"] == "diverged"
    assert last == expected.steps["episode"][-1] + 1
    assert expected.facts["stopped"].startswith("diverged")
    assert told(tab).startswith(f"RDES was stopped in episode {last}, with θ")
    drawn = tab.figure.locator(".panel svg").nth(2).locator("text").all_text_contents()
    assert not [text for text in drawn if len(text) > 4]  # no axis that only the last theta fills


def test_the_link_is_copied(opened):
    tab = opened(FIGURE, permissions=["clipboard-read", "clipboard-write"]).begun()
    tab.click("Copy code")
    tab.figure.locator(".along").get_by_text("Copied.").wait_for()
    copied = tab.page.evaluate("navigator.clipboard.readText()")
    assert copied == box(tab, "Library code of the same run")
    assert copied.startswith("from nmpcrl.study import Experiment, run")


def test_without_javascript_the_text_says_how_to_train(opened):
    tab = opened(FIGURE, java_script_enabled=False)
    assert tab.page.locator("article figure img[alt*='Five panels']").is_visible()
    assert "from a terminal" in tab.page.locator("article").inner_text()


@pytest.mark.parametrize("broken", ["module = 'AAAA'", "sources.push('not a script')"])
def test_training_that_fails_says_why(tab, broken):
    """A module that cannot be unpacked; a worker that does not begin."""
    tab.page.evaluate(f"window.nmpcrl.{broken}")
    tab.click("Train")
    tab.figure.get_by_text("this browser could not train: ").wait_for()
    assert tab.shown()["runs"][0]["state"] == "failed"
    assert tab.figure.get_by_role("button", name="Stop").get_attribute("aria-disabled") == "true"


def test_a_frozen_arm_that_fails_is_said_and_is_tried_again(tab):
    tab.page.evaluate(FAILS_ONCE, "frozen")
    fill(tab, Episodes=1)
    tab.click("Train")
    said = tab.figure.get_by_text("this browser could not train its frozen arm: ")
    assert "noise-free cost" in said.inner_text()
    tab.click("Train")
    tab.page.wait_for_function(ARMS_OF, arg=[0, 2])


def test_text_that_may_not_be_copied_is_selected(opened):
    for script in ("delete Navigator.prototype.clipboard", REFUSES):
        tab = opened(FIGURE, script=script).begun()
        tab.click("Copy link")
        tab.figure.locator(".along").get_by_text("does not copy").wait_for()
        assert tab.page.evaluate("getSelection().toString()").startswith("file:")
        assert tab.errors == []


@pytest.mark.parametrize("width", [390, 1400])
def test_axe_finds_nothing(opened, width):
    size = {"width": width, "height": 900}
    tab = opened(FIGURE, viewport=size, reduced_motion="reduce").begun()
    if not tab.figure.get_by_label("Episodes", exact=True).is_visible():
        tab.figure.get_by_text("Settings", exact=True).click()
    fill(tab, Episodes=1)
    tab.click("Train")
    trained(tab)
    tab.click("Lesson: the trap")
    told(tab)
    assert_figures_pass(tab.quiet().page, width)
    for target in tab.figure.locator(":is(.reach, input, select, button):visible").all():
        size = target.bounding_box()
        assert min(size["width"], size["height"]) >= 24
