"""Long work in a process of its own: it refuses code, and never outlives whoever asked."""

import asyncio
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from belt_sim.app.jobs import Job
from belt_sim.app.session import Session
from belt_sim.io import CAMPAIGNS, ROOT

WITHIN = 90.0  # [s], on a busy machine


ASKER = """
import multiprocessing, sys
from pathlib import Path
from belt_sim.app.jobs import SPAWN, work

if __name__ == "__main__":
    ear, mouth = SPAWN.Pipe(duplex=False)
    request = {"task": "diagnose", "model": "strip", "campaign": sys.argv[1], "effects": None}
    worker = SPAWN.Process(target=work, args=(request | {"bootstraps": 1000, "seed": 0}, Path(sys.argv[2]), mouth))
    worker.start()
    print(worker.pid, ear.recv()["stage"], flush=True)
    sys.stdin.read()
"""


def test_it_ends_when_nobody_listens_any_more(tmp_path):
    (tmp_path / "asker.py").write_text(ASKER)
    command = [sys.executable, tmp_path / "asker.py", CAMPAIGNS / "slack_belt", tmp_path]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    paths = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, cwd=tmp_path, text=True, env=paths, **pipes) as asker:
        worker, stage = asker.stdout.readline().split()
        assert stage == "reading"
        asker.kill()
    deadline = time.monotonic() + WITHIN
    while Path(f"/proc/{worker}").exists():
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(("failure", "said"), [("", ["files: refused"]), ("tension = 0", ["tension = 0"])])
def test_what_was_said_in_the_meantime_stays_when_work_ends(tmp_path, monkeypatch, failure, said):
    async def ended(job):
        job.failure = failure

    monkeypatch.setattr(Job, "run", ended)
    session = Session(tmp_path)
    session.notify("files: refused")
    before = session.version
    with ThreadPoolExecutor() as threads:  # a browser's tests may have a loop of their own in this one
        threads.submit(asyncio.run, session._listen(Job({}, tmp_path, "Diagnosis"))).result()
    assert session.messages == said
    assert session.version > before
