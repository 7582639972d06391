"""Page that follows a run: records arrive, the address is secret and local, and the server ends with the run."""

from __future__ import annotations

import json
import socket
import urllib.error
import urllib.request
from http.client import HTTPConnection
from pathlib import Path

import pytest
from click.testing import CliRunner

from fsm.cli.command_line import cli
from fsm.results.writer import ResultWriter
from fsm.views.report.watch import Watch
from tests.browser import CHROMIUM, Browser, NoBrowser
from tests.unit.test_report_page import records_of, strip

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"


def read(address: str) -> bytes:
    with urllib.request.urlopen(address, timeout=20) as answer:
        return answer.read()


@pytest.mark.nightly
def test_state_and_data_follow_the_records(tmp_path: Path) -> None:
    run = strip()
    records = records_of(run)
    with Watch(tmp_path, "test") as watch:
        watch.started -= 10.0
        assert json.loads(read(watch.address + "data")) == {}
        with ResultWriter(tmp_path / "result.h5", run.layout, flush_every=0.01) as writer:
            sizes = []
            for part in (records[:5], records[5:20]):
                for record in part:
                    writer.append(record)
                writer.flush()
                sizes.append(len(json.loads(read(watch.address + "data"))["player"]["records"]))
            assert sizes == [5, 20]
        watch.progress(0.5)
        state = json.loads(read(watch.address + "state"))
        assert state["fraction"] == 0.5
        assert state["version"].startswith("result.part.h5")
        assert not state["done"]
        assert b"connect-src 'self'" in read(watch.address)
    with pytest.raises(urllib.error.URLError):
        read(watch.address)


def test_the_address_is_local_and_secret(tmp_path: Path) -> None:
    with Watch(tmp_path, "test") as watch:
        assert watch.server.server_address[0] == "127.0.0.1"
        port = watch.server.server_address[1]
        for path, host in (
            ("/", watch.host),
            ("/state", watch.host),
            (f"/{watch.token[:-1]}/", watch.host),
            (f"/{watch.token}/../../etc/passwd", watch.host),
            (f"/{watch.token}/result.h5", watch.host),
            (f"/{watch.token}/", f"example.org:{port}"),
        ):
            connection = HTTPConnection("127.0.0.1", port, timeout=20)
            connection.request("GET", path, headers={"Host": host})
            assert connection.getresponse().status == 404, (path, host)
            connection.close()
        with socket.create_connection(("127.0.0.1", port), timeout=20) as raw:  # a target without a slash
            raw.sendall(f"GET nothing HTTP/1.0\r\nHost: {watch.host}\r\n\r\n".encode())
            assert b" 404 " in raw.recv(100)


def test_run_with_a_page(tmp_path: Path) -> None:
    small = ["strip.segments_per_panel=4", "drive.0.travel=1 mm", "expect=none"]
    options = [part for text in small for part in ("--set", text)]
    done = CliRunner().invoke(cli, ["run", str(CASE), "--out", str(tmp_path), "--watch", *options])
    assert done.exit_code == 0, done.output
    assert "http://127.0.0.1:" in done.stderr
    assert (tmp_path / "summary.json").is_file()


@pytest.mark.nightly
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian: apt-get install chromium)")
def test_the_page_follows_in_a_browser(tmp_path: Path) -> None:
    pytest.importorskip("websocket", reason="websocket-client is not installed; it drives the browser")
    run = strip()
    records = records_of(run)
    out = tmp_path / "out"
    out.mkdir()
    try:
        started = Browser(tmp_path / "profile")
    except NoBrowser as error:
        pytest.skip(str(error))
    with started as browser:
        with Watch(out, "test") as watch, ResultWriter(out / "result.h5", run.layout, flush_every=0.01) as writer:
            watch.started -= 10.0
            browser.open(watch.address, "typeof fsmReport !== 'undefined' && fsmReport.state")
            for count in (5, 20):
                for record in records[count - 5 if count == 5 else 5 : count]:
                    writer.append(record)
                writer.flush()
                watch.progress(count / 41)
                browser.wait(f"fsmReport.page && fsmReport.page.player.frames === {count}")
            assert browser.run("fsmReport.page.frame") == 19
            assert "48.8 %" in browser.run("document.getElementById('live-text').textContent")
        browser.wait("/finished|closed/.test(document.getElementById('live-text').textContent)", 20)
        assert [text for text in browser.messages if "GL Driver" not in text and "ERR_CONNECTION" not in text] == []
        assert {url.split("/")[2] for url in browser.requests} == {watch.host}
