"""A headless Chromium that opens pages and runs expressions in them, over its own pipe."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Pixels: TypeAlias = NDArray[np.uint8]

NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
"""Path of the browser, or ``None``."""

PATIENCE = 60.0
"""Seconds without a message after which the test fails."""

NEARLY = 48
"""Of 255: what lines lose at their edges."""

PLUMBING = """
import fcntl, os, sys
pipes = [fcntl.fcntl(int(pipe), fcntl.F_DUPFD, 10) for pipe in sys.argv[1:3]]
for pipe, wanted in zip(pipes, (3, 4)):
    os.dup2(pipe, wanted)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""A browser reads requests from file 3 and writes answers to file 4."""

COMPLAINTS = ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")


OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--disable-quic", "--window-size=1160,700"),
)


def with_more_script(page: str, more: str) -> str:
    """A page with more code at the end of its last script, which is a module."""
    before, end, after = page.rpartition("</script>")
    return f"{before}{more}\n{end}{after}"


def opened_up(page: str) -> str:
    """A page whose module lets ``Browser.value`` use its names; other scripts cannot see them."""
    return with_more_script(page, "globalThis.inside = (text) => eval(text);")


class Browser:
    """One page at a time; ``complaints`` are the messages of its console."""

    def __init__(self, profile: Path) -> None:
        assert CHROMIUM is not None
        theirs, self.to = os.pipe()
        self.back, ours = os.pipe()
        options = (*OPTIONS, f"--user-data-dir={profile}", "about:blank")
        self.process = subprocess.Popen(
            [sys.executable, "-c", PLUMBING, str(theirs), str(ours), CHROMIUM, *options],
            pass_fds=(theirs, ours),
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs)
        os.close(ours)
        self.unread = b""
        self.asked = 0
        self.session: dict[str, str] = {}
        self.complaints: list[Any] = []

    def __enter__(self) -> Self:
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        found = self._ask("Target.attachToTarget", targetId=target, flatten=True)
        self.session = {"sessionId": found["sessionId"]}
        for part in ("Page", "Runtime", "Log"):
            self._ask(f"{part}.enable")
        return self

    def __exit__(self, *_error: object) -> None:
        os.close(self.to)  # its end is the browser's, too
        os.close(self.back)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def open(self, path: Path, link: str = "") -> None:
        """Load a page, at a link such as ``#t=3``, and wait until it has."""
        self._ask("Page.navigate", url=path.as_uri() + link)
        self._wait()

    def reload(self) -> None:
        """Load the page again, as a user does."""
        self._ask("Page.reload")
        self._wait()

    def _wait(self) -> None:
        """Wait until a page has loaded."""
        while self._next().get("method") != "Page.loadEventFired":
            pass

    def look(self, width: int, dark: bool, height: int = 900) -> None:
        """Show pages at this size, px, and in dark mode or not."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._ask("Emulation.setDeviceMetricsOverride", **metrics)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._ask("Emulation.setEmulatedMedia", features=[scheme])

    def value(self, expression: str) -> Any:
        """The value of a JavaScript expression or promise, which may do what a click may.

        It can use the names of the module of a page that is ``opened_up``.
        """
        expression = f"(globalThis.inside ?? eval)({json.dumps(expression)})"
        asked = {"awaitPromise": True, "returnByValue": True, "userGesture": True}
        found = self._ask("Runtime.evaluate", expression=expression, **asked)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def picture(self) -> Pixels:
        """(*height*, *width*, 3) what the window shows: red, green and blue."""
        data = base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])
        return np.asarray(Image.open(BytesIO(data)).convert("RGB"))

    def part(self, name: str) -> Pixels:
        """What the window shows of an element."""
        place = """(() => {
          const shown = document.getElementById(NAME);
          shown.scrollIntoView({ block: "nearest" });
          const { left, top, right, bottom } = shown.getBoundingClientRect();
          return [left, top, right, bottom].map(Math.round);
        })()"""
        left, top, right, bottom = self.value(place.replace("NAME", json.dumps(name)))
        return self.picture()[max(top, 0) : bottom, max(left, 0) : right]

    def painted(self, name: str, *colours: str) -> list[int]:
        """How many pixels that the window shows of an element are nearly of each colour."""
        wanted = [[int(colour[at : at + 2], 16) for at in (1, 3, 5)] for colour in colours]
        shown = self.part(name).astype(int)
        apart = [np.max(abs(shown - colour), axis=2) for colour in wanted]
        return [int(np.count_nonzero(each <= NEARLY)) for each in apart]

    def _ask(self, method: str, **parameters: Any) -> Any:
        self.asked += 1
        asked = {"id": self.asked, "method": method, "params": parameters, **self.session}
        os.write(self.to, json.dumps(asked).encode() + b"\0")
        while (answer := self._next()).get("id") != self.asked:
            pass
        assert "error" not in answer, answer
        return answer["result"]

    def _next(self) -> dict[str, Any]:
        """The next message."""
        while b"\0" not in self.unread:
            ready, _, _ = select.select([self.back], [], [], PATIENCE)
            part = os.read(self.back, 1 << 20) if ready else b""
            assert part, "the browser sends nothing more"
            self.unread += part
        line, _, self.unread = self.unread.partition(b"\0")
        message: dict[str, Any] = json.loads(line)
        if message.get("method") in COMPLAINTS:
            self.complaints.append(message["params"])
        return message
