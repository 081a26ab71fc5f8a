"""A chapter's page with a live figure, and what a reader does on it, in Chromium or Firefox."""

import numpy as np

CHAPTERS = {  # of each live figure
    "intro": "intro",
    "controller": "01_mdp_and_nmpc",
    "gradient": "02_expected_sarsa",
    "chain": "04_ges",
    "runs": "05_results",
    "moving": "08_changing_world",
    "laboratory": "laboratory",
}
FRAMES = """figure => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(
    () => done(figure.shown))))"""
MATHJAX = "**/tex-svg-full.js*"
AS_TYPED = """document.head.insertAdjacentHTML(
    "beforeend", "<style>.math { display: none }</style>")"""
CHANGES = """figure => {
  window.changes = 0
  const options = {subtree: true, childList: true, attributes: true}
  new MutationObserver(all => window.changes += all.length).observe(figure, options)
}"""
MOST = 240_000  # bytes that a chapter's live figures may add, 150,000 of them the module


class Tab:
    """The page of a live figure, and what a reader does there; formulas are not typeset."""

    def __init__(self, page, site, figure):
        self.page, self.errors, self.requests = page, [], []
        self.figure = page.locator(f"figure.live[data-figure={figure}]")
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on(
            "console", lambda said: self.errors.append(said.text) if said.type == "error" else 0
        )
        page.on("request", lambda request: self.requests.append(request.url))
        page.route(MATHJAX, lambda it: it.fulfill(content_type="text/javascript", body=AS_TYPED))
        page.goto((site / f"book/{CHAPTERS[figure]}.html").resolve().as_uri())

    def begun(self) -> "Tab":
        """This page, once the figure shows results."""
        self.figure.locator(".results").wait_for(state="attached")
        return self

    def said(self) -> str:
        """The results, once nothing has changed for a while, as a screen reader is told them."""
        self.figure.locator("[role=status][aria-busy=false]").wait_for()
        return self.figure.locator("[role=status]").inner_text()

    def shown(self) -> dict:
        """What was asked and found, once it is drawn."""
        return self.figure.evaluate(FRAMES)

    def until(self, holds: str) -> dict:
        """What is shown once this holds of `shown`."""
        condition = f"figure => {{ const {{ given, found, runs }} = figure.shown; return {holds} }}"
        self.page.wait_for_function(condition, arg=self.figure.element_handle())
        return self.shown()

    def handle(self, name):
        return self.figure.get_by_role("slider", name=name, exact=True)

    def middle(self, name) -> np.ndarray:
        """Where a handle is on the screen, once the map is in its middle."""
        self.figure.locator("svg").first.evaluate("map => map.scrollIntoView({block: 'center'})")
        box = self.handle(name).locator(".reach").bounding_box()
        return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])

    def drag(self, name, by) -> None:
        """Drag a handle by so many pixels, in ten steps."""
        place = self.middle(name)
        self.page.mouse.move(*place)
        self.page.mouse.down()
        self.page.mouse.move(*(place + by), steps=10)
        self.page.mouse.up()

    def swipe(self, start, by, steps=10) -> None:
        """Move a finger from a place on the screen by so many pixels; in Chromium alone."""
        send = self.page.context.new_cdp_session(self.page).send
        places = [np.array(start) + np.array(by) * k / steps for k in range(steps + 1)]
        for k, (x, y) in enumerate(places):
            kind = "touchMove" if k else "touchStart"
            point = {"x": float(x), "y": float(y)}
            send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
        send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def press(self, name, *keys) -> dict:
        """Press keys on a handle or a slider; what is shown then."""
        self.handle(name).focus()
        for key in keys:
            self.page.keyboard.press(key)
        return self.shown()

    def click(self, button) -> dict:
        self.figure.get_by_role("button", name=button, exact=True).click()
        return self.shown()

    def fill(self, **fields) -> None:
        """Write into fields and leave them."""
        for name, text in fields.items():
            field = self.figure.get_by_label(name.replace("_", " "), exact=True)
            field = field.locator("visible=true")
            field.press("Control+a")
            field.press_sequentially(str(text))
            field.press("Tab")

    def choose(self, **values) -> dict:
        for name, value in values.items():
            field = self.figure.get_by_label(name.replace("_", " "), exact=True)
            field.select_option(value)
        return self.shown()

    def external(self) -> list[str]:
        """What the page has asked other places for."""
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:"))]


def loaded(site, figure) -> int:
    """The bytes of everything that the live figures of a figure's chapter load."""
    text = (site / f"book/{CHAPTERS[figure]}.html").read_text()
    files = site.glob("_static/live/*")
    return sum(path.stat().st_size for path in files if f"_static/live/{path.name}" in text)
