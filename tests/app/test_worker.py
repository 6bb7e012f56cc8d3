"""Long work in a process of its own: it refuses code, and never outlives whoever asked."""

import asyncio
import json
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from belt_sim.app.jobs import Job
from belt_sim.app.session import Session
from belt_sim.io import CAMPAIGNS, ROOT

WITHIN = 90.0  # [s], on a busy machine


@pytest.fixture
def worker():
    """A worker that waits for its request."""
    command = [sys.executable, "-m", "belt_sim.app.jobs"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command, cwd=ROOT, text=True, **pipes)
    yield process
    process.kill()
    process.wait()


def ask(process, folder, effects) -> None:
    request = {"task": "diagnose", "model": "strip", "campaign": str(CAMPAIGNS / "slack_belt"), "folder": str(folder)}
    process.stdin.write(json.dumps(request | {"effects": effects, "bootstraps": 1000, "seed": 0}) + "\n")
    process.stdin.flush()


def test_code_is_refused_by_the_worker_too(worker, tmp_path):
    ask(worker, tmp_path, ["models/effects/wind.py"])
    assert "code is not run" in json.loads(worker.stdout.readline())["failed"]


def test_it_ends_when_nobody_listens_any_more(worker, tmp_path):
    ask(worker, tmp_path, None)
    assert json.loads(worker.stdout.readline())["stage"] == "reading"
    worker.stdin.close()
    assert worker.wait(WITHIN) == -signal.SIGTERM
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
