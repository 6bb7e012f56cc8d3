"""Long work in a process of its own."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import pytest

from belt_sim.app.jobs import Job
from belt_sim.app.session import Session


def test_what_a_command_says_is_heard_and_its_error_is_a_line(tmp_path):
    async def ask(**settings):
        job = Job("compare", settings, tmp_path / "c", "Comparison")
        await job.run()
        return job

    with ThreadPoolExecutor() as threads:  # a browser's tests may have a loop of their own in this one
        job = threads.submit(asyncio.run, ask(campaign="slack_belt", model="strup")).result()
    assert job.state == "failed"
    assert job.failure.startswith("model = strup: ")
    assert "\n" not in job.failure


@pytest.mark.parametrize(("failure", "said"), [("", ["files: refused"]), ("tension = 0", ["tension = 0"])])
def test_what_was_said_in_the_meantime_stays_when_work_ends(tmp_path, monkeypatch, failure, said):
    async def ended(job):
        job.failure = failure

    monkeypatch.setattr(Job, "run", ended)
    session = Session(tmp_path)
    session.notify("files: refused")
    before = session.version
    with ThreadPoolExecutor() as threads:  # a browser's tests may have a loop of their own in this one
        threads.submit(asyncio.run, session._listen(Job("diagnose", {}, tmp_path, "Diagnosis"))).result()
    assert session.messages == said
    assert session.version > before
