"""Dropped files: what is taken, and what is refused in one line."""

import io
import zipfile

import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from fastapi.requests import HTTPConnection

from belt_sim.app import session as upload
from belt_sim.app.server import Guard, listen
from belt_sim.app.session import MAX_UPLOAD, read_effects
from belt_sim.errors import BeltError, InputError

EFFECTS = b"schema: belt-effects/1\neffects:\n  - id: %s\n    parameters:\n      kappa_t: 2.0e-5\n"


def zipped(members: dict[str, bytes]) -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return memory.getvalue()


def test_a_zip_gives_the_files_beside_its_campaign_and_nothing_else():
    data = zipped({"mine/campaign.yaml": b"a", "mine/runs.csv": b"b", "runs.csv": b"c", "mine/run.sh": b"d"})
    assert upload.sort_files([("mine.zip", data)]).campaign == {"campaign.yaml": b"a", "runs.csv": b"b"}


def test_no_name_leads_out_of_the_folder(tmp_path):
    data = zipped({"../../campaign.yaml": b"a", "../../runs.csv": b"b", "/etc/signals.csv": b"c"})
    tray = upload.sort_files([("x.zip", data), ("../../steady.csv", b"d"), ("..\\..\\signals.csv", b"e")])
    upload.write_files(tmp_path / "in", tray.campaign)
    found = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert found == {f"in/{name}" for name in ("campaign.yaml", "runs.csv", "steady.csv", "signals.csv")}


def test_a_zip_that_swells_is_stopped(monkeypatch):
    monkeypatch.setattr(upload, "MAX_UPLOAD", 2 * upload.MEBI)
    data = zipped({"campaign.yaml": b"a", "signals.csv": b"0" * (3 * upload.MEBI)})
    (line,) = upload.sort_files([("bomb.zip", data)]).messages
    assert "bomb.zip" in line
    assert "2 MB" in line


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("photo.png", b"", "photo.png"),
        ("effect.py", b"import os", "code is not run"),
        ("two.zip", zipped({"a/campaign.yaml": b"", "b/campaign.yaml": b""}), "2 campaigns"),
        ("none.zip", zipped({"a.txt": b""}), "no campaign.yaml"),
        ("broken.zip", b"PK\x03\x04 no", "cannot be unpacked"),
    ],
)
def test_files_of_no_use_have_one_line_each(name, data, told):
    tray = upload.sort_files([(name, data)])
    assert not tray.campaign
    (line,) = tray.messages
    assert told in line
    assert "\n" not in line


def test_effects_are_numbers_for_the_library():
    assert read_effects("effects.yaml", EFFECTS % b"taper") == [{"id": "taper", "kappa_t": 2e-5}]


def test_a_found_law_is_data():
    term = b"{place: yaw_tail, variable: beta, size: 0.1}"
    law = b"schema: belt-effects/2\neffects:\n  - {id: generic_law, tension: 1.0e+7, terms: [%s]}\n"
    (read,) = read_effects("found_law.yaml", law % term)
    assert read["terms"] == [{"place": "yaw_tail", "variable": "beta", "size": 0.1}]
    with pytest.raises(BeltError, match="use one of"):
        read_effects("found_law.yaml", law % term.replace(b"tail", b"middle"))


@pytest.mark.parametrize(
    "data",
    [
        EFFECTS % b"models/effects/wind.py",
        EFFECTS % b"../taper",
        b"schema: belt-effects/1\neffects: [taper.py]\n",
        b"a: &a [x, x]\nb: &b [*a, *a]\neffects: [*b, *b]\n",
        b"effects: !!python/object/apply:os.system [true]\n",
        b"\xff\xfe",
        b"x" * 70_000,
    ],
)
def test_code_and_bombs_are_no_effects(data):
    with pytest.raises(BeltError) as caught:
        read_effects("effects.yaml", data)
    assert "\n" not in str(caught.value)


def answered(headers: dict[str, str], kind: str = "http") -> int | None:
    """Status of the guard's answer to a request that bears the token; None where it is let through."""
    raw = [(k.encode(), v.encode()) for k, v in ({"cookie": "belt_sim_8080=t"} | headers).items()]
    scope = {"type": kind, "path": "/", "query_string": b"", "headers": raw, "scheme": "http"}
    answer = Guard(None, port=8080, token="t").answer(HTTPConnection(scope))
    return None if answer is None else answer.status_code


def test_the_guard_lets_its_own_pages_in_and_nobody_else():
    assert answered({"host": "127.0.0.1:8080"}) is None
    assert answered({"host": "localhost:8080", "origin": "http://localhost:8080"}, "websocket") is None
    assert answered({"host": "127.0.0.1:8080"}, "websocket") == 403
    for headers in (
        {},
        {"host": "127.0.0.1:8081"},
        {"host": "127.0.0.1:8080", "cookie": "belt_sim_8080=x"},
        {"host": "evil.example:8080"},
        {"host": "127.0.0.1:8080", "origin": "http://evil.example"},
        {"host": "127.0.0.1:8080", "origin": "null"},
        {"host": "127.0.0.1:8080", "sec-fetch-site": "cross-site"},
    ):
        assert answered(headers) == 403
    assert answered({"host": "127.0.0.1:8080", "content-length": str(MAX_UPLOAD + 1)}) == 413
    assert answered({"host": "127.0.0.1:8080", "transfer-encoding": "Chunked"}) == 411


def test_a_port_that_is_taken_has_its_line():
    with listen(None) as taken:
        assert taken.getsockname()[0] == "127.0.0.1"
        with pytest.raises(InputError, match="port = "):
            listen(taken.getsockname()[1])


def test_a_typographic_minus_keeps_its_sign():
    tray = upload.sort_files([("10Nmm2_yaw \u22120.042deg.csv", b"x")])
    assert [*tray.loggers] == ["10Nmm2_yaw -0.042deg.csv"]


def test_files_whose_names_collide_are_all_kept_and_named():
    dropped = [
        ("day1/lauf.csv", b"1"),
        ("day2/lauf.csv", b"2"),
        ("run#1.csv", b"3"),
        ("run@1.csv", b"4"),
        ("RUN#1.csv", b"5"),
    ]
    tray = upload.sort_files(dropped)
    assert [*tray.loggers.items()] == [
        ("lauf.csv", b"1"), ("lauf_2.csv", b"2"), ("run_1.csv", b"3"), ("run_1_2.csv", b"4"), ("RUN_1_3.csv", b"5"),
    ]  # fmt: skip
    assert len(tray.messages) == 3
    assert "lauf_2.csv" in tray.messages[0]
    twice = upload.sort_files(
        [("a/campaign.yaml", b"1"), ("b/campaign.yaml", b"2"), ("x.yaml", b"3"), ("y.yaml", b"4")]
    )
    assert twice.campaign == {"campaign.yaml": b"1"}
    assert twice.single == {"effects": ("x.yaml", b"3")}
    assert len(twice.messages) == 2
