"""A headless Chromium, driven through its DevTools over a pipe: what a page does in a real browser."""

import base64
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

# The browser reads commands from descriptor 3 and answers on 4; ours may bear these very numbers.
_LAUNCH = """
import fcntl, os, sys
read, write = (fcntl.fcntl(int(given), fcntl.F_DUPFD, 10) for given in sys.argv[1:3])
os.dup2(read, 3)
os.dup2(write, 4)
os.execvp(sys.argv[3], sys.argv[3:])
"""
_CODES = {
    "Escape": 27,
    "Home": 36,
    "ArrowLeft": 37,
    "ArrowUp": 38,
    "ArrowRight": 39,
    "ArrowDown": 40,
}
NAMES = ("chromium", "chromium-browser", "google-chrome")


def chromium() -> str | None:
    """The browser's command, None where none is installed."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Page:
    """One page of a browser of its own. Use as a context; `messages` holds what the console complained of."""

    def __init__(self, path: Path, width: int = 1280, height: int = 900, *, dark: bool = False):
        self.path, self.size, self.dark = path, (width, height), dark
        self.messages: list[str] = []
        self._number, self._unread = 0, b""

    def __enter__(self) -> "Page":
        self._profile = TemporaryDirectory(
            ignore_cleanup_errors=True
        )  # its children may still write
        to_read, self._write = os.pipe()
        self._read, to_write = os.pipe()
        options = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--remote-debugging-pipe",
        ]
        command = [
            chromium(),
            *options,
            "--allow-file-access-from-files",
            f"--user-data-dir={self._profile.name}",
        ]
        launch = [
            sys.executable,
            "-c",
            _LAUNCH,
            str(to_read),
            str(to_write),
            *command,
            "about:blank",
        ]
        quiet = {
            "stdin": subprocess.DEVNULL,
            "stdout": subprocess.DEVNULL,
            "stderr": subprocess.DEVNULL,
        }
        self._browser = subprocess.Popen(launch, pass_fds=(to_read, to_write), **quiet)
        os.close(to_read)
        os.close(to_write)
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")
        self.resize(*self.size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if self.dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[scheme])
        self.ask("Page.navigate", url=self.path.resolve().as_uri())
        self.run(
            "new Promise(done => document.readyState === 'complete' ? done(1) : addEventListener('load', done))"
        )
        return self

    def __exit__(self, *_) -> None:
        self._browser.terminate()
        self._browser.wait(timeout=20)
        os.close(self._read)
        os.close(self._write)
        self._profile.cleanup()

    def ask(self, method: str, **parameters) -> dict:
        """The answer to a DevTools command. Raises RuntimeError where it is an error."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        message |= {"sessionId": self._session} if hasattr(self, "_session") else {}
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            self._note(answer)
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def _next(self) -> dict:
        while b"\0" not in self._unread:
            read = os.read(self._read, 1 << 16)
            if not read:
                raise RuntimeError("the browser ended")
            self._unread += read
        text, _, self._unread = self._unread.partition(b"\0")
        return json.loads(text)

    def _note(self, message: dict) -> None:
        if message.get("method") == "Runtime.exceptionThrown":
            self.messages.append(message["params"]["exceptionDetails"]["text"])
        if message.get("method") == "Log.entryAdded":
            self.messages.append(message["params"]["entry"]["text"])
        if (
            message.get("method") == "Runtime.consoleAPICalled"
            and message["params"]["type"] == "error"
        ):
            self.messages.append(str(message["params"]["args"]))

    def run(self, script: str):
        """The value of a JavaScript expression, awaited."""
        how = {"returnByValue": True, "awaitPromise": True, "userGesture": True}
        answer = self.ask("Runtime.evaluate", expression=script, **how)
        if "exceptionDetails" in answer:
            raise RuntimeError(
                answer["exceptionDetails"].get("exception", {}).get("description", str(answer))
            )
        return answer["result"].get("value")

    def resize(self, width: int, height: int) -> None:
        """Another width of the window."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.ask("Emulation.setDeviceMetricsOverride", **size)

    def key(self, name: str) -> None:
        """Press a key of _CODES on what has the focus."""
        for kind in ("keyDown", "keyUp"):
            code = {"windowsVirtualKeyCode": _CODES[name]}
            self.ask("Input.dispatchKeyEvent", type=kind, key=name, code=name, **code)

    def drag(self, x: float, y: float, by_x: float, by_y: float) -> None:
        """Drag the mouse from a place of the window."""
        mouse = {"button": "left", "buttons": 1, "clickCount": 1}
        self.ask("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **mouse)
        self.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x + by_x, y=y + by_y, **mouse)
        self.ask("Input.dispatchMouseEvent", type="mouseReleased", x=x + by_x, y=y + by_y, **mouse)

    def screenshot(self, path: Path, *, whole: bool = True) -> None:
        """The page as a PNG; whole: all of it, not the window alone."""
        picture = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(picture["data"]))

    def print(self, path: Path) -> None:
        """The page as an A4 PDF."""
        answer = self.ask("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        path.write_bytes(base64.b64decode(answer["data"]))
