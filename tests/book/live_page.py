"""A chapter's page with a live figure, and what a reader does on it."""

import numpy as np

CHAPTERS = {  # of each live figure
    "intro": "intro",
    "controller": "01_mdp_and_nmpc",
    "gradient": "02_expected_sarsa",
    "kink": "02_expected_sarsa",
    "update": "02_expected_sarsa",
    "networks": "03_rdes",
    "chain": "04_ges",
    "learners": "04_ges",
    "runs": "05_results",
    "moving": "changing_world",
    "laboratory": "laboratory",
}
ALSO = ("07_beyond",)  # has the figure of runs, too
FRAMES = """figure => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(
    () => done(figure.shown))))"""
LATER = """count => new Promise(done => {
  const next = left => left ? requestAnimationFrame(() => next(left - 1)) : done()
  next(count)
})"""
OTHERWISE = {"alpha": 5.01e-8, "decay": "episode", "seed": 3}  # than two learners begin with
MOST = 240_000  # bytes that a chapter's live figures may add, 150,000 of them the module


class Tab:
    """The page of a live figure, and what a reader does there."""

    def __init__(self, page, site, figure, chapter=None):
        self.page, self.errors, self.requests = page, [], []
        self.figure = page.locator(f"figure.live[data-figure={figure}]")
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on(
            "console", lambda said: self.errors.append(said.text) if said.type == "error" else 0
        )
        page.on("request", lambda request: self.requests.append(request.url))
        page.goto((site / f"book/{chapter or CHAPTERS[figure]}.html").resolve().as_uri())

    def begun(self) -> "Tab":
        """This page, once the figure shows results."""
        self.figure.locator(".results").wait_for(state="attached")
        return self

    def quiet(self) -> "Tab":
        """This page, once nothing has changed for a while."""
        self.figure.locator("[role=status][aria-busy=false]").wait_for()
        return self

    def shown(self) -> dict:
        """What was asked and found, once it is drawn."""
        return self.figure.evaluate(FRAMES)

    def later(self, frames=30) -> "Tab":
        """This page, once it could have drawn so many pictures more."""
        self.page.evaluate(LATER, frames)
        return self

    def handle(self, name):
        return self.figure.get_by_role("slider", name=name, exact=True)

    def middle(self, name) -> np.ndarray:
        """Where a handle is on the screen."""
        box = self.handle(name).locator(".reach").bounding_box()
        return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])

    def see(self) -> None:
        self.figure.locator("svg").first.evaluate("map => map.scrollIntoView({block: 'center'})")

    def drag(self, name, by) -> None:
        """Drag a handle by so many pixels, in ten steps."""
        self.see()
        place = self.middle(name)
        self.page.mouse.move(*place)
        self.page.mouse.down()
        self.page.mouse.move(*(place + by), steps=10)
        self.page.mouse.up()

    def swipe(self, start, by, steps=2) -> None:
        """Move a finger from a place on the screen by so many pixels."""
        send = self.page.context.new_cdp_session(self.page).send
        places = [np.array(start) + np.array(by) * k / steps for k in range(steps + 1)]
        for k, (x, y) in enumerate(places):
            kind = "touchMove" if k else "touchStart"
            point = {"x": float(x), "y": float(y)}
            send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
        send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def press(self, name, *keys) -> None:
        self.handle(name).focus()
        for key in keys:
            self.page.keyboard.press(key)

    def click(self, button) -> None:
        self.figure.get_by_role("button", name=button, exact=True).click()

    def ask_otherwise(self) -> None:
        """Ask two learners for `OTHERWISE`, after a step of theirs that this takes back."""
        self.click("One step")
        self.figure.get_by_label("Noise decays").select_option(OTHERWISE["decay"])
        self.figure.get_by_label("Seed").select_option(str(OTHERWISE["seed"]))
        self.press("alpha, step size of theta", "ArrowLeft", "ArrowLeft", "ArrowLeft")
        shown = self.shown()
        assert shown["given"] == OTHERWISE
        assert [one["step"] for one in shown["found"]] == [None, None]

    def external(self) -> list[str]:
        """What the page has asked other places for."""
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:"))]


def loaded(site, figure) -> int:
    """The bytes of everything that the live figures of a figure's chapter load."""
    text = (site / f"book/{CHAPTERS[figure]}.html").read_text()
    files = site.glob("_static/live/*")
    return sum(path.stat().st_size for path in files if f"_static/live/{path.name}" in text)
