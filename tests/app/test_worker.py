"""Long work in a process of its own."""

import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from belt_sim.app.session import Job, Session
from belt_sim.campaign import read_campaign
from belt_sim.campaign.folder import campaign_folder


def session_of_a_sample(folder) -> Session:
    sample = campaign_folder("slack_belt")
    return Session(folder, campaign=read_campaign(sample), campaign_folder=sample)


def test_what_a_command_says_is_heard_and_its_error_is_a_line(tmp_path, in_loop):
    job = Job("compare", {"campaign": "slack_belt", "model": "strup"}, tmp_path / "c", "Comparison")
    in_loop(job.run())
    assert job.state == "No result"
    assert job.failure.startswith("model = strup: ")
    assert "\n" not in job.failure


@pytest.mark.parametrize(("failure", "said"), [("", ["files: refused"]), ("tension = 0", ["tension = 0"])])
def test_what_was_said_in_the_meantime_stays_when_work_ends(tmp_path, monkeypatch, in_loop, failure, said):
    session = session_of_a_sample(tmp_path)

    async def ended(job):
        session.notify("files: refused")
        job.failure = failure

    monkeypatch.setattr(Job, "run", ended)
    in_loop(session.work("diagnose"))
    assert (session.messages, session.version) == (said, 3)
