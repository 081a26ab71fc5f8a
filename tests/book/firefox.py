"""A Firefox as its distribution ships it, driven by WebDriver BiDi, which it speaks itself.

Playwright drives only a Firefox of its own making. Here a page is opened, asked, and used with
pointer, wheel and keys; https://w3c.github.io/webdriver-bidi describes the commands.
"""

import asyncio
import json
import re
import shutil
import subprocess
import threading
from base64 import b64decode
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

from tornado.websocket import WebSocketClosedError, websocket_connect

COMMANDS = ("firefox-esr", "firefox")
PATIENCE = 60  # until an answer comes [s]
LARGEST = 64 * 2**20  # of an answer, such as a picture [bytes]
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


class Refused(Exception):
    """Firefox did not do what it was asked."""


def installed() -> str | None:
    """Where a Firefox is."""
    return next(filter(None, map(shutil.which, COMMANDS)), None)


@contextmanager
def firefox(profile: Path, **preferences: Any) -> Iterator["Firefox"]:
    """A headless Firefox that nobody has used yet.

    Args:
        profile: an empty folder, which becomes its profile.
        **preferences: of about:config, with a double underscore for each dot.
    """
    asked = {name.replace("__", "."): value for name, value in preferences.items()}
    lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in (QUIET | asked).items()]
    (profile / "user.js").write_text("\n".join(lines))
    command = [installed(), "--headless", "--no-remote", "--remote-debugging-port=0"]
    with subprocess.Popen(
        [*command, "--profile", str(profile)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            address = next(filter(None, map(LISTENING.search, process.stderr)))[1]
            threading.Thread(target=process.stderr.read, daemon=True).start()  # or its pipe fills
            with connected(address) as socket:
                yield Firefox(socket)
        finally:
            process.terminate()


@contextmanager
def connected(address: str) -> Iterator["Socket"]:
    """A connection, in a thread of its own: playwright occupies the loop of this one."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    socket = Socket(loop)
    try:
        socket.wait(socket.open(f"{address}/session"))
        yield socket
    finally:
        socket.wait(socket.close())
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


class Socket:
    """Commands and their answers, and the events that come in between."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.loop, self.numbers, self.answers, self.events = loop, count(), {}, []

    def wait(self, coroutine) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(PATIENCE)

    async def open(self, url: str) -> None:
        self.connection = await websocket_connect(url, max_message_size=LARGEST)
        self.reading = self.loop.create_task(self.read())

    async def close(self) -> None:
        self.connection.close()
        await self.reading

    async def read(self) -> None:
        while text := await self.connection.read_message():
            message = json.loads(text)
            if message["type"] == "event":
                self.events.append(message)
            else:
                self.answers.pop(message["id"]).set_result(message)
        for answer in self.answers.values():
            answer.set_exception(WebSocketClosedError())

    async def send(self, message: dict) -> dict:
        answer = self.answers[message["id"]] = self.loop.create_future()
        await self.connection.write_message(json.dumps(message))
        return await answer

    def __call__(self, method: str, **parameters: Any) -> dict:
        """Do one command, and give its result."""
        message = {"id": next(self.numbers), "method": method, "params": parameters}
        answer = self.wait(self.send(message))
        if answer["type"] == "error":
            raise Refused(f"{method}: {answer['error']}: {answer['message']}")
        return answer["result"]


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
