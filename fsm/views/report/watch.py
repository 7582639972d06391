"""Page that follows a run: a server on the loopback address, closed with the run."""

from __future__ import annotations

import hmac
import json
import secrets
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from fsm.errors import FsmError
from fsm.results.store import read_solution
from fsm.views.report.packing import safe_json
from fsm.views.report.write import live_page, result_data

SHAPES, CHANNELS = 1_200_000, 400_000
"""Bytes of the shapes and of the channels that are sent each time."""
_GRACE = 4.0
"""Longest time that the server waits after the run, so that an open page receives the end of the run, s."""


class Watch:
    """Server of the page of a run, as a context manager; the server listens on 127.0.0.1 only.

    The address contains a random token. Requests without it, and requests for another host name, are refused. The server
    reads the results file of the run, and nothing else.

    Parameters
    ----------
    out : folder of the run
    title : title of the page

    Attributes
    ----------
    address : address of the page
    """

    def __init__(self, out: Path, title: str) -> None:
        self.out, self.title = Path(out), title
        self.token = secrets.token_urlsafe(24)
        self.fraction, self.done = 0.0, ""
        self.started = time.time()
        self._lock = threading.Lock()
        self._seen: tuple[str, float, int] | None = None
        self._asked = self._told = 0.0
        watch = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                watch.answer(self)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.host = f"127.0.0.1:{self.server.server_address[1]}"
        self.address = f"http://{self.host}/{self.token}/"
        self._thread = threading.Thread(target=self.server.serve_forever, args=(0.2,), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.done = "finished" if kind is None else "stopped"
        self.fraction = 1.0 if kind is None else self.fraction
        end = time.monotonic() + _GRACE
        while time.monotonic() < min(end, self._asked + _GRACE) and not self._told:
            time.sleep(0.05)
        self.server.shutdown()
        self.server.server_close()

    def progress(self, fraction: float) -> None:
        """Store the completed fraction of the run."""
        self.fraction = fraction

    def answer(self, request: BaseHTTPRequestHandler) -> None:
        """Answer a request for the page, its state, or its data."""
        _, token, *rest = request.path.split("/") if "/" in request.path else ("", "")
        if request.headers.get("Host") != self.host or not hmac.compare_digest(token.encode(), self.token.encode()):
            request.send_error(HTTPStatus.NOT_FOUND)
            return
        self._asked = time.monotonic()
        kind, body = "application/json", b"{}"
        if rest == [""]:
            kind, body = "text/html; charset=utf-8", live_page(self.title).encode()
        elif rest == ["state"]:
            body = json.dumps(self._state()).encode()
        elif rest == ["data"]:
            body = self._data().encode()
        else:
            request.send_error(HTTPStatus.NOT_FOUND)
            return
        request.send_response(HTTPStatus.OK)
        for name, value in (
            ("Content-Type", kind), ("Content-Length", str(len(body))), ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"), ("Referrer-Policy", "no-referrer"),
        ):  # fmt: skip
            request.send_header(name, value)
        request.end_headers()
        request.wfile.write(body)
        if rest == ["state"] and self.done:
            self._told = time.monotonic()

    def _file(self) -> Path | None:
        """Newest results file in the folder of the run or in a folder of its stages."""
        names = ("result.part.h5", "result.h5")
        found = [path for name in names for folder in (self.out, *self.out.glob("*/")) if (path := folder / name).is_file()]
        fresh = [path for path in found if path.stat().st_mtime >= self.started]
        return max(fresh, key=lambda path: path.stat().st_mtime, default=None)

    def _state(self) -> dict[str, Any]:
        path = self._file()
        version = "" if path is None else f"{path.name} {path.stat().st_mtime} {path.stat().st_size}"
        return {"fraction": self.fraction, "done": self.done, "version": version, "seconds": time.time() - self.started}

    def _data(self) -> str:
        """Data of the records so far; an empty object if there are none, or if the file is being replaced."""
        with self._lock:
            path = self._file()
            try:
                if path is None:
                    return "{}"
                solution = read_solution(path)
                return safe_json(result_data("run", solution, SHAPES, CHANNELS)) if len(solution) else "{}"
            except (FsmError, OSError, ValueError, LookupError):
                return "{}"
