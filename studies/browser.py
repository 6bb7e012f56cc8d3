"""A browser without a window, for pictures of pages: Chromium or Chrome, driven by Playwright."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from belt_sim.errors import InputError

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
