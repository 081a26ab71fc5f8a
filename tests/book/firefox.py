"""A Firefox as its distribution ships it, which speaks WebDriver BiDi itself.

Playwright takes only a Firefox of its own making. Here a page is opened, asked, and used with
pointer and keys; https://w3c.github.io/webdriver-bidi describes the commands.
"""

import json
import re
import shutil
import subprocess
import threading
from base64 import b64decode
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bidi import Refused, Socket, connected

COMMANDS = ("firefox-esr", "firefox")
LISTENING = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
EVENTS = ("log.entryAdded", "network.beforeRequestSent")
KEYS = {
    "Shift": "\ue008", "Tab": "\ue004", "Enter": "\ue007", "Space": " ", "Home": "\ue011",
    "ArrowLeft": "\ue012", "ArrowUp": "\ue013", "ArrowRight": "\ue014", "ArrowDown": "\ue015",
    "End": "\ue010",
}  # fmt: skip
QUIET = {  # nothing of its own: no updates, no experiments, no pages at its start
    "app.normandy.enabled": False,
    "app.update.disabledForTesting": True,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.page": 0,
    "datareporting.policy.dataSubmissionEnabled": False,
    "nimbus.rollouts.enabled": False,
    "services.settings.server": "data:,",
    "toolkit.telemetry.enabled": False,
}


def installed() -> str | None:
    """Where a Firefox is."""
    return next(filter(None, map(shutil.which, COMMANDS)), None)


@contextmanager
def firefox(profile: Path) -> Iterator["Firefox"]:
    """A headless Firefox that nobody has used yet; an empty folder becomes its profile."""
    lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in QUIET.items()]
    (profile / "user.js").write_text("\n".join(lines))
    command = [installed(), "--headless", "--no-remote", "--remote-debugging-port=0"]
    with subprocess.Popen(
        [*command, "--profile", str(profile)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            found = next(filter(None, map(LISTENING.search, process.stderr)), None)
            if found is None:
                raise Refused("Firefox ended before it listened")
            threading.Thread(target=process.stderr.read, daemon=True).start()  # or its pipe fills
            with connected(found[1]) as socket:
                yield Firefox(socket)
        finally:
            process.terminate()


class Firefox:
    """A session."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket
        self.version = socket("session.new", capabilities={})["capabilities"]["browserVersion"]
        socket("session.subscribe", events=list(EVENTS))

    def page(self, url: str, *, width: int = 1400, height: int = 1000) -> "Page":
        """A new tab of this size that has loaded the page."""
        page = Page(self.socket, self.socket("browsingContext.create", type="tab")["context"])
        page.tell("browsingContext.setViewport", viewport={"width": width, "height": height})
        page.tell("browsingContext.navigate", url=url, wait="complete")
        return page


class Page:
    """A tab, and what a reader does in it."""

    def __init__(self, socket: Socket, context: str) -> None:
        self.socket, self.context = socket, context

    def tell(self, method: str, **parameters: Any) -> dict:
        """A command about this tab."""
        return self.socket(method, context=self.context, **parameters)

    def happened(self, event: str) -> list[dict]:
        """The events of a kind so far."""
        return [each["params"] for each in self.socket.events if each["method"] == event]

    @property
    def errors(self) -> list[str]:
        """What went wrong in the page."""
        said = self.happened("log.entryAdded")
        mine = [each for each in said if each["source"].get("context") == self.context]
        return [each["text"] for each in mine if each["level"] == "error"]

    @property
    def requests(self) -> list[str]:
        """What the page asked for."""
        sent = self.happened("network.beforeRequestSent")
        return [each["request"]["url"] for each in sent if each["context"] == self.context]

    def evaluate(self, function: str, *arguments: Any) -> Any:
        """The result of a function of JavaScript, which may be a promise."""
        given = ", ".join(map(json.dumps, arguments))
        answer = self.socket(
            "script.evaluate",
            expression=f"(async () => JSON.stringify(await ({function})({given})) ?? 'null')()",
            target={"context": self.context},
            awaitPromise=True,
        )
        if answer["type"] == "exception":
            raise Refused(answer["exceptionDetails"]["text"])
        return json.loads(answer["result"]["value"])

    def perform(self, kind: str, actions: Sequence[dict], **parameters: Any) -> None:
        """Real input: `actions` of one device."""
        device = {"type": kind, "id": kind, "actions": list(actions), **parameters}
        self.tell("input.performActions", actions=[device])

    def drag(self, start: Sequence[float], end: Sequence[float], steps: int = 10) -> None:
        """Press the mouse at a point of the window, move it, and let it go."""
        way = [[a + (b - a) * k / steps for a, b in zip(start, end, strict=True)]
               for k in range(steps + 1)]  # fmt: skip
        moves = [{"type": "pointerMove", "x": round(x), "y": round(y)} for x, y in way]
        down, up = ({"type": f"pointer{name}", "button": 0} for name in ("Down", "Up"))
        self.perform("pointer", [moves[0], down, *moves[1:], up])

    def click(self, place: Sequence[float]) -> None:
        """Click at a point of the window."""
        self.drag(place, place, steps=1)

    def press(self, *keys: str) -> None:
        """Press keys, such as `Tab` or `Shift+ArrowUp`."""
        for key in keys:
            values = [KEYS.get(name, name) for name in key.split("+")]
            down = [{"type": "keyDown", "value": value} for value in values]
            up = [{"type": "keyUp", "value": value} for value in reversed(values)]
            self.perform("key", [*down, *up])

    def screenshot(self, path: Path) -> None:
        """What the window shows."""
        path.write_bytes(b64decode(self.tell("browsingContext.captureScreenshot")["data"]))

    def close(self) -> None:
        self.tell("browsingContext.close")
