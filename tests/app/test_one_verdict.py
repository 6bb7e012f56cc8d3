"""The same files have the same verdict by command line, app and Python."""

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

import belt_sim as bs
from belt_sim.app.session import Session
from belt_sim.commands.cli import run_command


def test_command_line_app_and_python_say_the_same(small, tmp_path, capsys):
    line, page = tmp_path / "line", Session(tmp_path / "page")
    asked = {"effects": ["taper"], "bootstraps": 100, "seed": 0}
    found = bs.diagnose(small, "strip", **asked)
    typed = ["effects=[taper]", "bootstraps=100", "seed=0", "model=strip", "pictures=false", "watch=null"]
    assert run_command(["diagnose", f"campaign={small}", *typed, f"hydra.run.dir={line}"]) == 0
    page.drop([(file.name, file.read_bytes()) for file in small.iterdir()])
    page.inputs |= {"candidates": ["taper"], "bootstraps": 100, "model": "strip"}

    async def ask():
        job = page.start("diagnose")
        while page.busy:
            await asyncio.sleep(0.1)
        return job

    with ThreadPoolExecutor(1) as thread:  # the browser's tests leave a loop in this one
        job = thread.submit(asyncio.run, ask()).result()
    assert (job.state, job.failure) == ("finished", "")
    by_line, by_page = (json.loads((folder / "diagnosis.json").read_text()) for folder in (line, job.folder))
    assert {k: v for k, v in by_line.items() if k != "provenance"} == {
        k: v for k, v in by_page.items() if k != "provenance"
    }
    assert by_line["sentence"] in " ".join(job.said.split())
    assert (str(found.verdict), found.sentence) == (by_line["verdict"], by_line["sentence"])
    told = " ".join(capsys.readouterr().out.split())
    assert found.headline in told
