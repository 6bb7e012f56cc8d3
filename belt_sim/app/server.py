"""The server of the app: on the loopback address, until it is stopped. It speaks only to pages that it served itself.

Any page that a browser has open may send requests to 127.0.0.1. Two headers, which no page can forge, tell them
apart: Host names the address that the browser asked for (a foreign name that was made to point here stays foreign), and
Origin names the page that asks. Everything else is refused, web sockets included, and so is more than ``MAX_UPLOAD``.
Other accounts of the machine reach the address too: the one that is printed bears a token, which the browser keeps as a
cookie.
"""

import contextlib
import html
import secrets
import shutil
import socket
import threading
import traceback
import webbrowser
from collections.abc import Mapping
from hmac import compare_digest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import parse_qsl, quote, urlencode

import uvicorn
from fastapi import FastAPI
from fastapi.responses import Response
from nicegui import app as pages_app
from nicegui import ui

from belt_sim.app import measurements_page, simulate_page
from belt_sim.app.session import MAX_UPLOAD, TOO_LARGE, Session
from belt_sim.errors import InputError

ADDRESS = "127.0.0.1"
REPORT = "report.html"
PATIENCE = 30.0  # [s] for a tab that does not answer before it is forgotten
#: a page made from data may draw itself; it may neither load, send, nor reach the app it stands in
SANDBOX = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:"
)
ICON = (
    "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32'><g fill='none' stroke='#1f86cc' stroke-width='3'>"
    "<circle cx='9' cy='16' r='6'/><circle cx='23' cy='16' r='6'/><path d='M9 10h14M9 22h14'/></g></svg>"
)


class Guard:
    """ASGI middleware: lets through what names ``port`` on the loopback address and bears the token."""

    def __init__(self, app: Any, port: int, token: str) -> None:
        self.app, self.token, self.cookie = app, token, f"belt_sim_{port}"
        self.hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
        self.origins = {f"http://{host}" for host in self.hosts}

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Hand on, or answer with one line; an address with the token sets the cookie and goes on without it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {k.decode("latin-1").lower(): v.decode("latin-1").strip() for k, v in scope["headers"]}
        refused = self.refusal(headers, scope["type"])
        asked = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1")))
        given, rest = asked.pop("token", ""), urlencode(asked)
        head = [(b"content-type", b"text/plain; charset=utf-8")]
        if refused is None and scope["type"] == "http" and compare_digest(given.encode(), self.token.encode()):
            cookie = f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
            head += [
                (b"location", f"{quote(scope['path'])}{'?' * bool(rest)}{rest}".encode()),
                (b"set-cookie", cookie.encode()),
            ]
            refused = 303, "belt-sim app is open here"
        pairs = (pair.strip().partition("=") for pair in headers.get("cookie", "").split(";"))
        known = any(n == self.cookie and compare_digest(v.encode(), self.token.encode()) for n, _, v in pairs)
        if refused is None and not known:
            refused = 403, "open the address that belt-sim app has printed in its terminal; it bears a token"
        if refused is None:
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            status, line = refused
            await send({"type": "http.response.start", "status": status, "headers": head})
            await send({"type": "http.response.body", "body": line.encode()})

    def refusal(self, headers: dict[str, str], kind: str) -> tuple[int, str] | None:
        """Status and reason, None to let through; kind: http, or websocket, which states its origin."""
        if headers.get("host", "").lower() not in self.hosts:
            return 403, "belt-sim app answers to 127.0.0.1 only"
        is_socket = kind == "websocket" or headers.get("upgrade", "").lower() == "websocket"
        own = "" if is_socket else next(iter(self.origins))
        if headers.get("origin", own).lower() not in self.origins:
            return 403, "belt-sim app answers to its own pages only"
        if headers.get("sec-fetch-site", "").lower() in ("cross-site", "same-site"):
            return 403, "belt-sim app answers to its own pages only"
        if "chunked" in headers.get("transfer-encoding", "").lower():
            return 411, "say how long the request is"
        length = headers.get("content-length", "0")
        if not length.isdigit() or int(length) > MAX_UPLOAD:
            return 413, TOO_LARGE
        return None


def listen(port: int | None) -> socket.socket:
    """A socket on the loopback address; ``port`` None: any that is free. Raises InputError when it is taken."""
    made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((ADDRESS, port or 0))
        made.listen()
    except OSError as error:
        made.close()
        raise InputError("port", port, "", f"{error.strerror}; choose another, or leave it out") from error
    return made


def serve(folder: Path, port: int | None = None, *, show: bool = True) -> None:
    """Serve the pages until Ctrl-C; results go to ``folder``. show: open a browser."""
    ear = listen(port)
    chosen = ear.getsockname()[1]
    token = secrets.token_urlsafe(24)
    address = f"http://{ADDRESS}:{chosen}/?token={token}"
    session = Session(folder)
    outer = application(session, chosen, token)
    print(f"belt_sim is open at {address} for this account of this machine. Ctrl-C ends it.", flush=True)
    if show:
        threading.Timer(1.0, webbrowser.open, (address,)).start()
    config = uvicorn.Config(outer, log_level="warning", loop="asyncio", ws_max_size=2**24, timeout_graceful_shutdown=2)
    with contextlib.suppress(KeyboardInterrupt):  # how it is meant to end
        uvicorn.Server(config).run(sockets=[ear])


def application(session: Session, port: int, token: str) -> FastAPI:
    """Pages and files behind the guard; files of results go by number and by name, no path comes from outside."""
    outer = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)

    def of_result(number: int) -> Path | None:
        done = 1 <= number <= len(session.jobs) and not session.jobs[number - 1].running
        return session.jobs[number - 1].folder if done else None

    @outer.get("/results/{number}/report")
    def report(number: int) -> Response:
        return _file(of_result(number), REPORT, {"Content-Security-Policy": SANDBOX})

    @outer.get("/results/{number}/picture/{name}")
    def picture(number: int, name: str) -> Response:
        return _file(of_result(number), name if name.endswith(".png") else "")

    @outer.get("/results/{number}/zip")
    def download(number: int) -> Response:
        return _zip(of_result(number))

    @outer.get("/campaign")
    def campaign() -> Response:
        return _zip(session.campaign_folder if session.campaign else None)

    simulate_page.add_sliders()
    measurements_page.add_measurements(session)
    pages_app.on_shutdown(session.close)
    pages_app.on_exception(traceback.print_exception)  # what broke in a page goes to the terminal, whole
    look: dict[str, Any] = {"title": "belt_sim", "favicon": ICON, "dark": None, "tailwind": False}
    ui.run_with(outer, **look, reconnect_timeout=PATIENCE, show_welcome_message=False)
    outer.add_middleware(Guard, port=port, token=token)
    return outer


MISSING = Response("there is no such result", 404, media_type="text/plain")
FRESH = {"X-Content-Type-Options": "nosniff", "Cache-Control": "no-store"}


def _file(folder: Path | None, name: str, head: Mapping[str, str] | None = None) -> Response:
    """A file that lies in a folder, by its name."""
    there = {path.name: path for path in folder.iterdir() if path.is_file()} if folder else {}
    if name not in there:
        return MISSING
    media = "text/html" if name == REPORT else "image/png"
    return Response(there[name].read_bytes(), media_type=media, headers={**FRESH, **(head or {})})


def _zip(folder: Path | None) -> Response:
    """All files of a folder."""
    if folder is None:
        return MISSING
    with TemporaryDirectory() as place:
        packed = Path(shutil.make_archive(f"{place}/packed", "zip", folder.parent, folder.name)).read_bytes()
    head = {"Content-Disposition": f'attachment; filename="{html.escape(folder.name)}.zip"', **FRESH}
    return Response(packed, media_type="application/zip", headers=head)
