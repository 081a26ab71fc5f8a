"""A connection to a browser that speaks WebDriver BiDi: commands, their answers, and events."""

import asyncio
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any

from tornado.websocket import WebSocketClosedError, websocket_connect

PATIENCE = 60  # until an answer comes [s]
LARGEST = 64 * 2**20  # of an answer, such as a picture [bytes]


class Refused(Exception):
    """The browser did not do what it was asked."""


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
