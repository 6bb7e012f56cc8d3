"""Dropped files: what is taken, and what is refused in one line."""

import io
import socket
import zipfile

import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from fastapi.requests import HTTPConnection

from belt_sim.app import session as upload
from belt_sim.app.server import Guard, free_port
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
    found, messages = upload.sort_files([("mine.zip", data)])
    assert (found["campaign"], messages) == ({"campaign.yaml": b"a", "runs.csv": b"b"}, [])


def test_no_name_leads_out_of_the_folder(tmp_path):
    data = zipped({"../../campaign.yaml": b"a", "../../runs.csv": b"b", "/etc/signals.csv": b"c"})
    dropped = [("x.zip", data), ("../../steady.csv", b"d"), ("..\\..\\run one.csv", b"e")]
    found, _ = upload.sort_files(dropped)
    upload.Session(tmp_path).new_folder("in", found["campaign"] | found["logger"])
    found = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert found == {f"in_1/{name}" for name in ("campaign.yaml", "runs.csv", "steady.csv", "run one.csv")}


def test_a_zip_that_swells_is_stopped(monkeypatch):
    monkeypatch.setattr(upload, "MAX_UPLOAD", 2 * upload.MEBI)
    data = zipped({"campaign.yaml": b"a", "signals.csv": b"0" * (3 * upload.MEBI)})
    found, (line,) = upload.sort_files([("bomb.zip", data)])
    assert not found["campaign"]
    assert "bomb.zip" in line
    assert "2 MB" in line


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("photo.png", b"", "photo.png"),
        ("effect.py", b"import os", "is not read by this page; drop campaign.yaml"),
        ("effects.yaml", b"effects: []", "not read by this page"),
        ("two.zip", zipped({"a/campaign.yaml": b"", "b/campaign.yaml": b""}), "2 campaign.yaml; zip the folder of one"),
        ("none.zip", zipped({"a.txt": b""}), "0 campaign.yaml; zip the folder of one"),
        ("broken.zip", b"PK\x03\x04 no", "cannot be unpacked"),
    ],
)
def test_files_of_no_use_have_one_line_each(name, data, told):
    found, (line,) = upload.sort_files([(name, data)])
    assert not any(found.values())
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
    port = free_port(None)
    assert free_port(port) == port
    with socket.create_server(("127.0.0.1", port)), pytest.raises(InputError, match=f"port = {port}: .*choose another"):
        free_port(port)


def test_a_typographic_minus_keeps_its_sign():
    found, _ = upload.sort_files([("10Nmm2_yaw \u22120.042deg.csv", b"x")])
    assert [*found["logger"]] == ["10Nmm2_yaw -0.042deg.csv"]


def test_of_files_whose_names_collide_the_first_is_kept_and_the_others_are_named():
    dropped = [("day1/lauf.csv", b"1"), ("day2/lauf.csv", b"2"), ("run#1.csv", b"3"), ("RUN@1.csv", b"4")]
    found, messages = upload.sort_files(dropped)
    assert found["logger"] == {"lauf.csv": b"1", "run_1.csv": b"3"}
    assert ["lauf.csv is there already" in messages[0], "run_1.csv is there already" in messages[1]] == [True, True]
    assert all("give each file another name" in line for line in messages)
    twice = [(f"{folder}/{file}", b"1") for folder in "ab" for file in ("campaign.yaml", "mapping.yaml")]
    found, messages = upload.sort_files(twice)
    assert (found["campaign"], found["mapping"]) == ({"campaign.yaml": b"1"}, {"mapping.yaml": b"1"})
    assert len(messages) == 2


def test_a_mapping_may_have_any_name_and_there_is_one():
    data = b"schema: belt-mapping/1\n"
    found, (second, third) = upload.sort_files([("my_rig.yaml", data), ("other.yml", data), ("notes.yaml", b"a: 1")])
    assert found["mapping"] == {"my_rig.yaml": data}
    assert "my_rig.yaml is there already; drop one" in second
    assert "notes.yaml" in third


def test_a_loggers_files_beside_a_campaign_are_named_and_do_not_stop_it(tmp_path):
    session = upload.Session(tmp_path)
    files = [(p.name, p.read_bytes()) for p in (CAMPAIGNS / "slack_belt").iterdir() if p.name in upload.FILES]
    session.drop([*files, ("bare.csv", b"1;2\n"), ("empty.csv", b""), ("bin.csv", b"\0\1")])
    assert session.messages == [
        "bare.csv, empty.csv, bin.csv: not used beside campaign.yaml; drop a logger's files alone"
    ]
    assert session.campaign is not None
