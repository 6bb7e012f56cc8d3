"""The same files have the same verdict by command line, app and Python."""

import json

import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

import belt_sim as bs
from belt_sim.app import jobs
from belt_sim.cli import run_command


def test_command_line_app_and_python_say_the_same(small, tmp_path, capsys):
    line, page = (tmp_path / name for name in ("line", "page"))
    page.mkdir()
    asked = {"effects": ["taper"], "bootstraps": 100, "seed": 0}
    found = bs.diagnose(small, "strip", **asked)
    typed = ["effects=[taper]", "bootstraps=100", "seed=0", "model=strip", "pictures=false", "watch=null"]
    assert run_command(["diagnose", f"campaign={small}", *typed, f"hydra.run.dir={line}"]) == 0
    request = asked | {"task": "diagnose", "campaign": str(small), "model": "strip"}
    shown = jobs._diagnose(request, page, lambda **message: None)
    by_line, by_page = (json.loads((folder / "diagnosis.json").read_text()) for folder in (line, page))
    assert {k: v for k, v in by_line.items() if k != "provenance"} == {
        k: v for k, v in by_page.items() if k != "provenance"
    }
    assert (shown["verdict"], shown["lines"]) == (by_line["verdict"], [by_line["sentence"]])
    assert (str(found.verdict), found.sentence) == (by_line["verdict"], by_line["sentence"])
    told = " ".join(capsys.readouterr().out.split())
    assert found.headline in told
