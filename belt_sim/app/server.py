"""The server of the app: on the loopback address, until it is stopped. It speaks only to pages that it served itself.

Any page that a browser has open may send requests to 127.0.0.1. Two headers, which no page can forge, tell them
apart: Host names the address that the browser asked for (a foreign name that was made to point here stays foreign), and
Origin names the page that asks. Everything else is refused, web sockets included, and so is more than ``MAX_UPLOAD``.
Other accounts of the machine reach the address too: the one that is printed bears a token, which the browser keeps as a
cookie.
"""

import asyncio
import secrets
import socket
from contextlib import suppress
from dataclasses import dataclass
from hmac import compare_digest
from pathlib import Path
from typing import Any

from fastapi.requests import HTTPConnection
from fastapi.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from nicegui import app, ui

from belt_sim.app import measurements_page, simulate_page  # noqa: F401 - which are then served
from belt_sim.app.session import MAX_UPLOAD, REPORT, TOO_LARGE, Session
from belt_sim.errors import InputError

ADDRESS = "127.0.0.1"
TAB_PATIENCE = 30.0  # [s] for a tab that does not answer before it is forgotten
#: a page made from data may draw itself; it may neither load, send, nor reach the app it stands in
SANDBOX = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:"
)
FRESH = {"Content-Security-Policy": SANDBOX, "X-Content-Type-Options": "nosniff", "Cache-Control": "no-store"}
OWN_PAGES = "belt-sim app answers to its own pages only"


@dataclass
class Guard:
    """ASGI middleware: lets through what names ``port`` on the loopback address and bears the token."""

    app: Any
    port: int
    token: str

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Hand on, or answer with one line."""
        answer = self.answer(HTTPConnection(scope)) if scope["type"] in ("http", "websocket") else None
        if answer is None:
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await answer(scope, receive, send)

    def answer(self, asked: HTTPConnection) -> Response | None:
        """Why a request is refused, or for an address with the token the cookie; None to let it through."""
        hosts, cookie = [f"{name}:{self.port}" for name in (ADDRESS, "localhost")], f"belt_sim_{self.port}"
        origins, token = [f"http://{host}" for host in hosts], self.token.encode()
        head, own = {k: v.lower() for k, v in asked.headers.items()}, origins[0]
        if "websocket" in (asked.scope["type"], head.get("upgrade")):
            own = ""  # a socket states its origin
        length = head.get("content-length", "0")
        for holds, status, line in (
            (head.get("host") in hosts, 403, f"belt-sim app answers to {ADDRESS} only"),
            (head.get("origin", own) in origins, 403, OWN_PAGES),
            (head.get("sec-fetch-site") not in ("cross-site", "same-site"), 403, OWN_PAGES),
            ("chunked" not in head.get("transfer-encoding", ""), 411, "say how long the request is"),
            (length.isdigit() and int(length) <= MAX_UPLOAD, 413, TOO_LARGE),
        ):
            if not holds:
                return PlainTextResponse(line, status)
        if compare_digest(asked.query_params.get("token", "").encode(), token):
            rest = asked.url.remove_query_params("token")
            answer = RedirectResponse(f"/{rest.path.lstrip('/')}{'?' * bool(rest.query)}{rest.query}", 303)
            answer.set_cookie(cookie, self.token, httponly=True, samesite="strict")
            return answer
        if compare_digest(asked.cookies.get(cookie, "").encode(), token):
            return None
        line = "open the address that belt-sim app has printed in its terminal; it bears a token"
        return PlainTextResponse(line, 403)


def free_port(port: int | None) -> int:
    """``port``, or any that is free on the loopback address if None. Raises InputError when it cannot be had."""
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((ADDRESS, port or 0))
        except OSError as error:
            raise InputError("port", port, "", f"{error.strerror}; choose another, or leave it out") from error
        return int(tried.getsockname()[1])


def serve(folder: Path, port: int | None = None, *, show: bool = True) -> None:
    """Serve the pages until Ctrl-C; results go to ``folder``. show: open a browser."""
    port, token, session = free_port(port), secrets.token_urlsafe(24), Session(folder)

    @app.get("/results/{number}/report")
    def report(number: int) -> Response:
        """The report of a result, by its number: no path comes from outside."""
        done = [job.folder / REPORT for k, job in enumerate(session.jobs, 1) if k == number and job.state != "running"]
        if not done or not done[0].is_file():
            return PlainTextResponse("there is no such result", 404)
        return FileResponse(done[0], headers=FRESH)

    @app.on_exception
    def tell(error: Exception) -> None:
        session.notify(f"This page broke down ({type(error).__name__}: {error}); please report it")

    @app.on_shutdown
    def close() -> None:
        if session.busy:
            session.jobs[-1].stop()

    page, said = f"/?token={token}", "for this account of this machine. Ctrl-C ends it."

    async def announce() -> None:  # once it answers: NiceGUI starts before its server listens
        while True:
            with suppress(OSError):
                (await asyncio.open_connection(ADDRESS, port))[1].close()
                break
            await asyncio.sleep(0.05)
        print(f"belt_sim is open at http://{ADDRESS}:{port}{page} {said}", flush=True)

    app.on_startup(announce)
    app.state.session = session
    app.add_middleware(Guard, port=port, token=token)
    look: Any = {"title": "belt_sim", "favicon": "⚙", "dark": None, "tailwind": False, "show_welcome_message": False}
    own: Any = {"reload": False, "reconnect_timeout": TAB_PATIENCE, "timeout_graceful_shutdown": 2}
    with suppress(KeyboardInterrupt):  # how it is meant to end
        ui.run(host=ADDRESS, port=port, show=show and page, **look, **own)
