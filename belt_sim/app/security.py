"""Who may speak to the server: only pages that it served itself, on the loopback address.

Any page that a browser has open may send requests to 127.0.0.1. Two headers, which no page can forge, tell them
apart: Host names the address that the browser asked for (a foreign name that was made to point here stays foreign), and
Origin names the page that asks. Everything else is refused, web sockets included, and so is more than ``MAX_UPLOAD``.
"""

from typing import Any

MEBI = 2**20
MAX_UPLOAD = 256 * MEBI  # bytes of one request
TOO_LARGE = (
    f"at most {MAX_UPLOAD // MEBI} MB at a time; drop fewer at once, or give them to belt-sim import in a terminal"
)
LOOPBACK = ("127.0.0.1", "localhost")


class Guard:
    """ASGI middleware: lets through what names ``port`` on the loopback address."""

    def __init__(self, app: Any, port: int) -> None:
        self.app = app
        self.hosts = {f"{name}:{port}" for name in LOOPBACK}
        self.origins = {f"http://{host}" for host in self.hosts}

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Hand on, or answer with one line."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        refused = self.refusal({k.decode("latin-1").lower(): v.decode("latin-1") for k, v in scope["headers"]})
        if refused is None:
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            status, line = refused
            head = [(b"content-type", b"text/plain; charset=utf-8")]
            await send({"type": "http.response.start", "status": status, "headers": head})
            await send({"type": "http.response.body", "body": line.encode()})

    def refusal(self, headers: dict[str, str]) -> tuple[int, str] | None:
        """Status and reason; None for a request that is let through."""
        if headers.get("host") not in self.hosts:
            return 403, "belt-sim app answers to 127.0.0.1 only"
        if headers.get("origin", next(iter(self.origins))) not in self.origins:
            return 403, "belt-sim app answers to its own pages only"
        if headers.get("sec-fetch-site") in ("cross-site", "same-site"):
            return 403, "belt-sim app answers to its own pages only"
        if "chunked" in headers.get("transfer-encoding", ""):
            return 411, "say how long the request is"
        length = headers.get("content-length", "0")
        if not length.isdigit() or int(length) > MAX_UPLOAD:
            return 413, TOO_LARGE
        return None
