"""A Rerun recording as a picture, as the viewer shows it: ``python -m studies.viewer_picture file=outputs/x/belt.rrd``.

Rerun's web viewer is opened in a browser without a window; its upper bar, which says nothing of the belt, is cut off.
"""

import functools
import http.server
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import rerun as rr

from belt_sim.errors import InputError
from studies.app_pictures import open_tab
from studies.application import application

BAR = 36  # [px], height of the viewer's own bar


class _Files(http.server.SimpleHTTPRequestHandler):
    """Files of one folder, for the viewer's page too."""

    def end_headers(self) -> None:
        self.send_header("Access-Control-Allow-Origin", "*")
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        pass


@contextmanager
def serve_files(folder: Path) -> Iterator[str]:
    """The files of ``folder`` at an address of this machine."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Files, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()


def picture_of(config: Mapping[str, Any]) -> None:
    """Shoot the viewer once the recording has been read."""
    file, picture = Path(config["file"]), Path(config["picture"])
    if not file.is_file():
        raise InputError("file", file, "", "give a recording (.rrd)")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    rr.serve_web_viewer(web_port=port, open_browser=False)
    width, height = config["size"]
    with serve_files(file.parent) as address, open_tab(width, height + BAR, dark=config["dark"], webgl=True) as page:
        recording = quote(f"{address}/{file.name}", safe="")
        page.goto(f"http://127.0.0.1:{port}/?renderer=webgl&url={recording}", wait_until="commit")
        page.wait_for_timeout(1000 * config["wait"])
        picture.parent.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=picture, clip={"x": 0, "y": BAR, "width": width, "height": height}, timeout=120_000)
    print(f"{picture}: {picture.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    application("viewer_picture", picture_of)
