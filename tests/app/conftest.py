"""The app as people meet it: a server of its own, and a real browser."""

import asyncio
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from belt_sim.io import CAMPAIGNS, ROOT

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
STARTS_WITHIN = 120.0  # [s], on a busy machine
PATIENCE = 60_000  # [ms] for anything that a page shows
ENDS_WITHIN = 20.0  # [s]


@dataclass(frozen=True)
class Served:
    """A running app: its address, port and token, the folder that it writes to, and its process."""

    address: str
    port: int
    token: str
    folder: Path
    process: subprocess.Popen


@pytest.fixture(scope="session")
def served(tmp_path_factory) -> Iterator[Served]:
    """``belt-sim app`` without a browser of its own."""
    pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")
    folder = tmp_path_factory.mktemp("app")
    command = [sys.executable, "-m", "belt_sim", "app", "open=false", f"hydra.run.dir={folder}"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    outside = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}  # by which NiceGUI knows a test
    process = subprocess.Popen(command, cwd=ROOT, env=outside, **pipes)
    stopper = threading.Timer(STARTS_WITHIN, process.kill)
    stopper.start()
    assert process.stdout is not None
    said = ""
    while not (found := re.search(r"(http://127\.0\.0\.1:(\d+))/\?token=([\w-]+)", said)):
        line = process.stdout.readline()
        assert line, f"the app ended without an address: {said}"
        said += line
    stopper.cancel()
    yield Served(found[1], int(found[2]), found[3], folder, process)
    process.send_signal(signal.SIGINT)
    assert process.wait(ENDS_WITHIN) == 0


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A real browser; skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs Playwright: pip install playwright")
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        pytest.skip(f"needs a browser: one of {', '.join(BROWSERS)}")
    with playwright.sync_playwright() as p:
        opened = p.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def in_loop() -> Callable[..., Any]:
    """Runs a coroutine: in a thread, as the browser has a loop of its own in this one."""

    def run(work: Any) -> Any:
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(asyncio.run, work).result()

    return run


@pytest.fixture(scope="session")
def page(browser, served) -> Iterator[Any]:
    """The tab of all tests, which must neither complain nor ask anybody but the app."""
    context = browser.new_context(viewport={"width": 1400, "height": 1000})
    context.add_cookies([{"name": f"belt_sim_{served.port}", "value": served.token, "url": served.address}])
    tab = context.new_page()
    tab.set_default_timeout(PATIENCE)
    complaints, strangers = [], []
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.on(
        "request", lambda r: None if r.url.startswith((served.address, "data:", "blob:")) else strangers.append(r.url)
    )
    yield tab
    context.close()
    assert not complaints
    assert not strangers


@pytest.fixture(scope="session")
def small(tmp_path_factory) -> Path:
    """Four short, sparse runs of a sample campaign: enough to compare and to diagnose something small."""
    source, folder = CAMPAIGNS / "slack_belt", tmp_path_factory.mktemp("small")
    shutil.copy(source / "campaign.yaml", folder)
    kept = ("r01", "r02", "r05", "r06")
    for name in ("runs.csv", "signals.csv"):
        head, *rows = (source / name).read_text().splitlines()
        rows = [r for r in rows if r.split(",")[0] in kept]
        if name == "signals.csv":
            rows = [r for r in rows if (travel := float(r.split(",")[1])) <= 30 and travel % 2 == 0]
        (folder / name).write_text("\n".join([head, *rows]) + "\n")
    return folder
