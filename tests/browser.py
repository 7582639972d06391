"""Headless Chromium for tests of pages, driven by the DevTools protocol."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

CHROMIUM = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-extensions", "--disable-dev-shm-usage", "--mute-audio",
    "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--remote-debugging-port=0", "--remote-allow-origins=*",
)  # fmt: skip


class NoBrowser(RuntimeError):
    """Chromium does not start on this machine."""


class Browser:
    """Browser with one page.

    Attributes
    ----------
    messages : texts of the console with level error or warning, and of uncaught errors
    requests : addresses of all requests except data and blob addresses
    """

    def __init__(self, profile: Path, width: int = 1400, height: int = 1000) -> None:
        import websocket

        assert CHROMIUM is not None
        command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}", "about:blank"]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.messages: list[str] = []
        self.requests: list[str] = []
        self._number = 0
        try:
            address = self._address()
            self._socket = websocket.create_connection(address, timeout=60, suppress_origin=True)
            target = next(t for t in self._call("Target.getTargets")["targetInfos"] if t["type"] == "page")
            attached = self._call("Target.attachToTarget", {"targetId": target["targetId"], "flatten": True})
            self._session = attached["sessionId"]
            for domain in ("Page", "Runtime", "Log", "Network"):
                self.call(f"{domain}.enable")
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
            self.call("Emulation.setDeviceMetricsOverride", size)
        except BaseException:
            self.process.kill()
            raise

    def _address(self) -> str:
        """Address of the browser, from its output."""
        assert self.process.stderr is not None
        limit = threading.Timer(60.0, self.process.kill)
        limit.start()
        try:
            for line in self.process.stderr:
                found = re.search(r"DevTools listening on (ws://\S+)", line)
                if found:
                    return found[1]
        finally:
            limit.cancel()
        raise NoBrowser("Chromium does not start on this machine")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self._call("Browser.close")
            self.process.wait(10)
        except Exception:
            self.process.kill()
        self.process.wait(10)
        if self.process.stderr is not None:
            self.process.stderr.close()

    def call(self, method: str, params: dict[str, Any] | None = None) -> dict[str, Any]:
        """Result of a command for the page."""
        return self._call(method, params, self._session)

    def _call(self, method: str, params: dict[str, Any] | None = None, session: str = "") -> dict[str, Any]:
        self._number += 1
        message = {"id": self._number, "method": method, "params": params or {}} | (
            {"sessionId": session} if session else {}
        )
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self._event(answer.get("method", ""), answer.get("params", {}))

    def _event(self, method: str, params: dict[str, Any]) -> None:
        if method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.messages.append(" ".join(str(arg.get("value", arg.get("description", ""))) for arg in params["args"]))
        elif method == "Runtime.exceptionThrown":
            detail = params["exceptionDetails"]
            self.messages.append(f"{detail['text']} {detail.get('exception', {}).get('description', '')}")
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.messages.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            url = params["request"]["url"]
            if not url.startswith(("data:", "blob:")):
                self.requests.append(url)

    def open(self, url: str, wait_for: str = "document.readyState === 'complete'", timeout: float = 60.0) -> None:
        """Open an address and wait until a condition holds."""
        self.messages, self.requests = [], []
        self.call("Page.navigate", {"url": url})
        self.wait(wait_for, timeout)

    def wait(self, condition: str, timeout: float = 60.0) -> None:
        """Wait until a JavaScript condition holds."""
        end = time.monotonic() + timeout
        while not self.run(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise TimeoutError(f"{condition} does not hold after {timeout} s; console: {self.messages[:5]}")
            time.sleep(0.05)

    def run(self, script: str) -> Any:
        """Value of a JavaScript expression; promises are awaited."""
        found = self.call("Runtime.evaluate", {"expression": script, "returnByValue": True, "awaitPromise": True})
        if "exceptionDetails" in found:
            detail = found["exceptionDetails"]
            raise RuntimeError(detail.get("exception", {}).get("description", detail["text"]))
        return found["result"].get("value")

    def move(self, x: float, y: float) -> None:
        """Move the mouse to a point of the window."""
        self.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": x, "y": y})

    def click(self, x: float, y: float) -> None:
        """Click with the mouse at a point of the window."""
        self.move(x, y)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1})

    def screenshot(self, path: Path, whole: bool = False) -> None:
        """Write a picture of the window, or of the whole page."""
        data = self.call("Page.captureScreenshot", {"format": "png", "captureBeyondViewport": whole} | self._clip(whole))
        path.write_bytes(base64.b64decode(data["data"]))

    def _clip(self, whole: bool) -> dict[str, Any]:
        if not whole:
            return {}
        size = self.call("Page.getLayoutMetrics")["cssContentSize"]
        return {"clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}}
