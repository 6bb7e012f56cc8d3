"""The server itself: loopback only, its own pages only; and the command without its extra."""

import http.client
import socket
from pathlib import Path

import pytest

from belt_sim import app
from belt_sim.commands.runs import RunDir
from belt_sim.errors import BeltError


def get(served, path="/", token=None, **headers) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=20)
    cookie = {"Cookie": f"belt_sim_{served.port}={served.token if token is None else token}"}
    connection.request("GET", path, headers=cookie | headers)
    answer = connection.getresponse()
    return answer.status, answer.read().decode(errors="replace")


def test_another_account_of_the_machine_is_turned_away(served):
    socket_io = "/_nicegui_ws/socket.io/?EIO=4&transport=polling"
    for path in ("/", "/measurements", "/results/1/zip", "/?token=wrong", socket_io):
        assert get(served, path, token="")[0] == 403
        assert get(served, path, token="wrong")[0] == 403
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=20)
    connection.request("GET", f"/measurements?token={served.token}")
    answer = connection.getresponse()
    assert (answer.status, answer.getheader("location")) == (303, "/measurements")
    assert {"httponly", "samesite=strict"} <= {*answer.getheader("set-cookie").lower().split("; ")}


def test_headers_are_compared_without_case(served):
    assert get(served, **{"Transfer-Encoding": "Chunked"})[0] == 411
    assert get(served, Host=f"LocalHost:{served.port}")[0] == 200
    assert get(served, **{"Sec-Fetch-Site": "Cross-Site"})[0] == 403


def test_a_machine_that_cannot_be_has_its_page(served):
    """Guard: pulleys that overlap ended it in a server error."""
    assert get(served, "/?rig=own&centre_distance=1&pulley_radius=2")[0] == 200


def test_only_the_loopback_address_answers(served):
    assert get(served)[0] == 200
    for other in ("127.0.0.2", socket.gethostbyname(socket.gethostname())):
        if other != "127.0.0.1":
            with pytest.raises(OSError):  # noqa: PT011
                socket.create_connection((other, served.port), timeout=5).close()


def test_foreign_names_and_pages_are_turned_away(served):
    assert get(served, Host="evil.example")[0] == 403
    assert get(served, Origin="http://evil.example")[0] == 403
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    key = {"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    place = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert get(served, place, Origin="http://evil.example", **upgrade, **key)[0] == 403
    assert get(served, place, **upgrade, **key)[0] == 403  # a page's socket states where it comes from


def test_results_go_by_number(served):
    for path in ("/results/99/report", "/results/0/zip", "/results/..%2f..%2fetc/zip"):
        assert get(served, path)[0] in (404, 422)


def test_without_its_extra_the_command_says_what_to_install(monkeypatch):
    monkeypatch.setattr(app, "find_spec", lambda name: None)
    with pytest.raises(BeltError, match=r"pip install 'belt-sim\[app\]'"):
        app.app_command(RunDir(Path(), "app", {"port": None, "open": False}))


@pytest.mark.parametrize("settings", [{"port": "x"}, {"port": 70000}, {"port": True}, {"open": "maybe"}])
def test_settings_that_cannot_be(settings):
    with pytest.raises(BeltError, match="give"):
        app.app_command(RunDir(Path(), "app", {"port": None, "open": True} | settings))
