"""The pictures of docs/app.md and docs/report.md, shot of the app and of a report: ``python -m studies.app_pictures``.

A server of its own and a browser without a window: the sliders, a logger's files as they are understood, and the report
of a diagnosis (three of its runs and four candidates, which they cannot tell apart).
"""

import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from belt_sim.errors import InputError
from belt_sim.io import MODEL_FOLDER, ROOT
from studies.application import application

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
#: WebGL by software, so that a machine without a graphics card draws the same
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


@contextmanager
def open_tab(width: int, height: int, *, dark: bool = False, webgl: bool = False) -> Iterator[Any]:
    """An empty tab of this size [px], webgl: that can draw in space; raises InputError where there is no browser."""
    from playwright.sync_api import sync_playwright

    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        raise InputError("browser", "none", "", f"install one of {', '.join(BROWSERS)}")
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=path, args=["--no-sandbox", *(SOFTWARE if webgl else ())])
        yield browser.new_page(viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light")
        browser.close()


PATIENCE = 120_000  # [ms] for anything that the page shows
DIAGNOSED = 1200.0  # [s] for a diagnosis on a busy machine
TALL = 1500  # [px] of a page that shows a report whole: its frame is a share of the page
LOGGED = sorted((MODEL_FOLDER / "loggers").glob("lauf_*.csv"))
CURVES = "[data-name={}] svg path"


@contextmanager
def serve_app() -> Iterator[str]:
    """The address, with its token, of an app that writes into a folder which goes with it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "belt_sim", "app", "open=false", f"hydra.run.dir={folder}"]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = map(re.compile(r"http://127\.0\.0\.1:\d+/\?token=[\w-]+").search, process.stdout or ())
        try:
            if (found := next(filter(None, said), None)) is None:
                raise InputError("app", "ended", "", "it needs NiceGUI: pip install 'belt-sim[app]'")
            yield found.group()
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)


def simulate(page: Any, address: str) -> Any:
    """A slack belt at a large yaw, with a conical pulley."""
    page.goto(f"{address}/?tension=7&yaw=-0.15")
    page.wait_for_selector(CURVES.format("curves"), state="attached")
    page.locator("[data-name=find]").fill("conical")
    page.get_by_text("Taper: a pulley that is a cone").click()
    page.get_by_text("taper of the tail pulley").wait_for()
    page.get_by_label("computing").wait_for(state="hidden")
    page.mouse.click(5, 5)
    page.wait_for_timeout(1500)
    return page.locator("main, .q-page").first


def import_card(page: Any, address: str) -> Any:
    """The card of a logger's files, before what is asked has been answered."""
    page.goto(f"{address}/measurements")
    page.locator("input[type=file]").wait_for(state="attached")
    page.locator("input[type=file]").set_input_files([str(p) for p in LOGGED])
    for group, name in (("machine", "test_rig"), ("belt", "paper_belt")):
        page.locator(f"[data-name={group}]").click()
        page.get_by_role("option", name=name).click()
    page.get_by_role("button", name="Update").click()
    page.get_by_text("How wide is the belt").wait_for(state="detached")
    page.get_by_text("What your files seem to say").wait_for()
    page.wait_for_timeout(500)
    return page.locator("section", has_text="What your files seem to say")


def report(page: Any, address: str) -> Any:
    """The card of a diagnosis with its report: a tie."""
    page.goto(f"{address}/measurements")
    files = [(p.name, p) for p in LOGGED[:3]] + [("mapping.yaml", MODEL_FOLDER / "loggers" / "my_rig.yaml")]
    given = [{"name": n, "mimeType": "text/plain", "buffer": p.read_bytes()} for n, p in files]
    page.locator("input[type=file]").set_input_files(given)
    page.get_by_role("button", name="Use this data").click()
    page.get_by_text("More about the diagnosis").click()
    tried = {"conical": "Taper: a pulley", "scraper": "Side drag: a scraper", "square": "Idler skew: a roller"}
    for word, title in tried.items():
        page.locator("[data-name=find]").fill(word)
        page.get_by_text(title).click()
    page.locator("label", has_text="model").first.click()
    page.get_by_role("option", name="strip: hanging").click()
    page.get_by_role("button", name="Diagnose").click()
    page.locator("[data-name=stage]").wait_for()
    page.goto("about:blank")  # a page that shows progress takes time off the work
    ends = time.monotonic() + DIAGNOSED
    while not page.request.get(f"{address}/results/1/report").ok:
        if time.monotonic() > ends:
            raise InputError("report", "no answer", "", f"the diagnosis took more than {DIAGNOSED:g} s")
        page.wait_for_timeout(2000)
    page.set_viewport_size({"width": page.viewport_size["width"], "height": TALL})
    page.goto(f"{address}/measurements")
    page.frame_locator("iframe[title=report]").locator("#overlays svg.shown").wait_for()
    page.wait_for_timeout(2000)
    return page.locator("section", has_text="Diagnosis of")


def demo_report(page: Any, address: str) -> Any:
    """The top of the report of the demo (docs/report.md), which is diagnosed where no demo has run here."""
    folder = Path("outputs") / "demo" / "diagnosis"
    if not (folder / "report.html").exists():
        command = [sys.executable, "-m", "belt_sim", "diagnose", "campaign=slack_belt", "model=beam_th2"]
        subprocess.run([*command, f"hydra.run.dir={folder}"], check=True)
    page.set_viewport_size({"width": 1100, "height": 1150})
    page.goto((folder / "report.html").resolve().as_uri())
    page.wait_for_timeout(1000)
    return page


PICTURES = {"app_simulate": simulate, "app_import": import_card, "app_report": report, "report": demo_report}


def shoot(config: Mapping[str, Any]) -> None:
    """One picture after the other, of one app."""
    folder = Path(config["folder"])
    unknown = [n for n in config["names"] if n not in PICTURES]
    if unknown:
        raise InputError("names", unknown, "", f"use some of {', '.join(PICTURES)}")
    with serve_app() as address:
        for name in config["names"]:
            with open_tab(*config["size"], dark=config["dark"]) as page:
                page.set_default_timeout(PATIENCE)
                page.goto(address)  # with the token, which the tab keeps
                seen = PICTURES[name](page, address.partition("/?")[0])
                if seen is not page:
                    seen.scroll_into_view_if_needed()
                seen.screenshot(path=folder / f"{name}.png", timeout=PATIENCE)
            print(folder / f"{name}.png")


if __name__ == "__main__":
    application("app_pictures", shoot)
