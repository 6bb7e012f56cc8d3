"""Dropped files: what is taken, and what is refused in one line."""

import io
import zipfile

import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from fastapi.requests import HTTPConnection

from belt_sim.app import session as upload
from belt_sim.app.server import Guard, listen
from belt_sim.app.session import MAX_UPLOAD
from belt_sim.errors import InputError
from belt_sim.io import CAMPAIGNS


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
    upload.Session(tmp_path).new_folder("in", tray.campaign)
    found = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert found == {f"in_1/{name}" for name in ("campaign.yaml", "runs.csv", "steady.csv", "signals.csv")}


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
        ("effect.py", b"import os", "not read by this page"),
        ("effects.yaml", b"effects: []", "not read by this page"),
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
        [(f"{folder}/{file}", b"1") for folder in "ab" for file in ("campaign.yaml", "mapping.yaml")]
    )
    assert (twice.campaign, twice.mapping) == ({"campaign.yaml": b"1"}, b"1")
    assert len(twice.messages) == 2


def test_a_mapping_may_have_any_name_and_there_is_one():
    data = b"schema: belt-mapping/1\n"
    tray = upload.sort_files([("my_rig.yaml", data), ("other.yml", data), ("notes.yaml", b"a: 1")])
    assert (tray.mapping, tray.mapping_name) == (data, "my_rig.yaml")
    second, third = tray.messages
    assert "my_rig.yaml is the mapping already" in second
    assert "notes.yaml" in third


def test_a_loggers_files_beside_a_campaign_are_named_and_do_not_stop_it(tmp_path):
    session = upload.Session(tmp_path)
    files = [(p.name, p.read_bytes()) for p in (CAMPAIGNS / "slack_belt").iterdir() if p.name in upload.FILES]
    session.drop([*files, ("bare.csv", b"1;2\n"), ("empty.csv", b""), ("bin.csv", b"\0\1")])
    assert session.messages == [
        "bare.csv, empty.csv, bin.csv: not used beside campaign.yaml; drop a logger's files alone"
    ]
    assert session.campaign is not None
