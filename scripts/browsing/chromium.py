"""A Chromium without a window: opens pages at a width, tells what they load and how they look.

It is spoken to in its DevTools protocol (https://chromedevtools.github.io/devtools-protocol/) over
two pipes, messages in JSON that end with a zero byte.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

if sys.platform != "win32":
    import fcntl

NAMES = ("chromium", "chromium-browser", "google-chrome")
NEEDED = "FLEXLINK_NEEDS_CHROMIUM"  # variable of the environment: without a Chromium tests fail
OPTIONS = (
    "--headless", "--remote-debugging-pipe", "--no-sandbox", "--disable-gpu", "--disable-quic",
    "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip
READS, WRITES = 3, 4  # descriptors that Chromium reads messages from, and writes them to
ABOVE = 10  # descriptors of pipes begin here, clear of these two
LONGEST_SILENCE = 60.0  # s: a browser that says nothing for so long hangs
BAD = ("error", "warning")  # levels of the console that are told
Message = dict[str, Any]


def program() -> str | None:
    """Path of a Chromium, None if there is none, or none that can be spoken to (Windows)."""
    if sys.platform == "win32":
        return None
    return next(filter(None, map(shutil.which, NAMES)), None)


def lacking() -> bool:
    """Tell whether there is no Chromium, and none is asked for: tests in one are skipped."""
    return program() is None and not os.environ.get(NEEDED)


class Page:
    """A page in a window of a size in pixels, and what became of it since it was opened."""

    def __init__(self, connection: _Connection, session: str) -> None:
        self._connection, self._session = connection, session
        self._size = (0, 0)
        for domain in ("Page", "Network", "Runtime", "Log"):
            self._ask(f"{domain}.enable")

    def open(self, file: Path, width: int, height: int, *, dark: bool = False) -> None:
        """Open a file in a window of this size; a phone has two pixels for one."""
        self._size = width, height
        colours = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self._ask("Emulation.setEmulatedMedia", features=colours)
        self._resize(height)
        self._connection.forget()
        self._ask("Page.navigate", url=file.resolve().as_uri())
        self._connection.wait_for("Page.loadEventFired")

    def value(self, expression: str) -> Any:
        """Value of an expression of JavaScript in the page; a promise is waited for."""
        answer = self._ask(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            raise ValueError(answer["exceptionDetails"])
        return answer["result"].get("value")

    @property
    def asked(self) -> list[str]:
        """Addresses that the page loaded, or tried to; data in the page itself are none."""
        found = self._connection.told("Network.requestWillBeSent")
        addresses = [event["request"]["url"] for event in found]
        return [address for address in addresses if not address.startswith(("data:", "blob:"))]

    @property
    def complaints(self) -> list[str]:
        """What the browser complains of: errors of scripts, and of what the page may not do."""
        errors = self._connection.told("Runtime.exceptionThrown")
        entries = [event["entry"] for event in self._connection.told("Log.entryAdded")]
        said = [str(entry["text"]) for entry in entries if entry["level"] in BAD]
        return [*said, *(str(event["exceptionDetails"]) for event in errors)]

    def drag(self, *places: tuple[float, float]) -> None:
        """Press the mouse at the first place, x and y in pixels, and let it go at the last."""
        kinds = ["mousePressed", *["mouseMoved"] * (len(places) - 2), "mouseReleased"]
        for kind, (x, y) in zip(kinds, places, strict=True):
            pressed = {"button": "left", "buttons": int(kind != "mouseReleased"), "clickCount": 1}
            self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **pressed)

    def picture(self, *, whole: bool = True) -> bytes:
        """Return a PNG of the window, or of the whole page."""
        if whole:  # images below the window are drawn when they come near it
            self._resize(int(self.value("document.documentElement.scrollHeight")))
        shown = self._ask("Page.captureScreenshot", format="png")
        self._resize(self._size[1])
        return b64decode(shown["data"])

    def printed(self) -> bytes:
        """Return a PDF of the page, printed on A4."""
        self._ask("Emulation.clearDeviceMetricsOverride")
        paper = {"paperWidth": 8.27, "paperHeight": 11.69}  # inches
        told = self._ask("Page.printToPDF", **paper, preferCSSPageSize=True, printBackground=True)
        return b64decode(told["data"])

    def _resize(self, height: int) -> None:
        width = self._size[0]
        self._ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=2 if width < 600 else 1,
            mobile=width < 600,
        )  # fmt: skip

    def _ask(self, method: str, **given: Any) -> Message:
        return self._connection.ask(method, self._session, **given)


class _Connection:
    """Messages to and from a Chromium."""

    def __init__(self, reads: int, writes: int) -> None:
        self._to, self._from = os.fdopen(writes, "wb"), os.fdopen(reads, "rb")
        self._asked, self._events, self._rest = 0, list[Message](), b""

    def ask(self, method: str, session: str = "", **given: Any) -> Message:
        """Send a message; return its answer."""
        self._asked += 1
        message: Message = {"id": self._asked, "method": method, "params": given}
        if session:
            message["sessionId"] = session
        self._to.write(json.dumps(message).encode() + b"\0")
        self._to.flush()
        while True:
            answer = self._next()
            if answer.get("id") != self._asked:
                self._events.append(answer)
                continue
            if "error" in answer:
                raise RuntimeError(f"{method}: {answer['error']}")
            found: Message = answer["result"]
            return found

    def wait_for(self, event: str) -> None:
        """Wait for an event that was not told since the others were forgotten."""
        while not self.told(event):
            self._events.append(self._next())

    def told(self, event: str) -> list[Message]:
        """Return what all events of a name told so far."""
        return [own["params"] for own in self._events if own.get("method") == event]

    def forget(self) -> None:
        """Forget the events so far."""
        self._events.clear()

    def _next(self) -> Message:
        while b"\0" not in self._rest:
            if not select.select([self._from], [], [], LONGEST_SILENCE)[0]:
                raise RuntimeError("the browser does not answer")
            more = os.read(self._from.fileno(), 1 << 20)
            if not more:
                raise RuntimeError("the browser has ended")
            self._rest += more
        first, _, self._rest = self._rest.partition(b"\0")
        told: Message = json.loads(first)
        return told


@contextmanager
def browser() -> Iterator[Page]:
    """Yield a page in a browser of its own, which ends with it.

    Raises:
        FileNotFoundError: there is no Chromium.

    """
    found = program()
    if found is None:
        raise FileNotFoundError("no Chromium")
    (its_input, to), (its, its_output) = os.pipe(), os.pipe()
    given = [fcntl.fcntl(own, fcntl.F_DUPFD, ABOVE) for own in (its_input, its_output)]

    def take_pipes() -> None:
        os.dup2(given[0], READS)
        os.dup2(given[1], WRITES)

    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        process = subprocess.Popen(
            [found, *OPTIONS, f"--user-data-dir={folder}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(READS, WRITES, *given),
            preexec_fn=take_pipes,  # noqa: PLW1509
        )
        for own in (its_input, its_output, *given):
            os.close(own)
        try:
            connection = _Connection(its, to)
            target = connection.ask("Target.createTarget", url="about:blank")["targetId"]
            session = connection.ask("Target.attachToTarget", targetId=target, flatten=True)
            yield Page(connection, session["sessionId"])
            connection.ask("Browser.close")
            process.wait(timeout=10)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
