"""The app, the command line and Python take one model for one campaign, and say why."""

from dataclasses import replace

import pytest

from belt_sim.api import check, compare, inference
from belt_sim.api.compare import validity_warnings
from belt_sim.api.simulate import campaign_model, model_for_campaign
from belt_sim.app.session import Session
from belt_sim.campaign import read_campaign
from belt_sim.campaign.folder import campaign_folder


def measured(name: str, tension: float | None = None, at: str | None = None):
    campaign = read_campaign(campaign_folder(name))
    runs = tuple(replace(r, tension=tension or r.tension) for r in campaign.runs)
    signals = tuple(replace(s, at=at or s.at) for s in campaign.signals[:1]) + campaign.signals[1:]
    source = replace(campaign.source, kind="measured") if tension or at else campaign.source
    return replace(campaign, runs=runs, signals=signals, source=source)


CASES = [
    (measured("slack_belt"), "strip", "simulated"),
    (measured("slack_belt", tension=10e6), "strip_lift_off", "(10 N/mm2) is so slack"),
    (measured("slack_belt", tension=40e6), "strip", "no run"),
    (measured("slack_belt", tension=10e6, at="upper_span at 2.0 m"), "strip", "inside a span"),
    (measured("slack_belt", tension=10e6, at="tail_wrap at 0.2 m"), "strip_lift_off", "so slack"),
]


class Chosen(Exception):
    pass


def tell_chosen(model, curves=True):
    raise Chosen(model.name)


@pytest.mark.parametrize("stated", [None, "by_tension", {"name": "by_tension", "step": 0.05, "keep": 0.1}])
@pytest.mark.parametrize(("campaign", "model", "why"), CASES)
def test_every_question_about_a_campaign_has_its_model(campaign, model, why, stated, monkeypatch):
    """Python gives None, the command line its configuration, the app a name; a report names the model it was given."""
    for module in (inference, compare, check):
        monkeypatch.setattr(module, "fitted_model", tell_chosen)
    monkeypatch.setattr(inference, "beside_points", lambda campaign: [])
    effects = ["taper"]
    for ask in (inference.diagnose, inference.discover, compare.compare, check.check):
        with pytest.raises(Chosen, match=f"^{model}$"):
            ask(campaign, stated, effects)
    with pytest.raises(Chosen, match=f"^{model}$"):
        inference.fit(campaign, effects, stated)


@pytest.mark.parametrize(("campaign", "model", "why"), CASES)
def test_what_is_chosen_is_not_warned_about(campaign, model, why):
    said = " ".join(validity_warnings(campaign, campaign_model(None, campaign), ()))
    assert "use model=strip_lift_off" not in said
    assert ("lifts it off" in said) == (why == "inside a span"), said  # what strip lacks there is told


@pytest.mark.parametrize(("campaign", "model", "why"), CASES)
def test_one_campaign_has_one_model(campaign, model, why, tmp_path, monkeypatch, in_loop):
    assert campaign_model(None, campaign).name == model
    assert campaign_model({"name": "by_tension"}, campaign).name == model
    assert why in model_for_campaign(campaign)
    session = Session(tmp_path, campaign=campaign, campaign_folder=tmp_path)

    async def nothing(job):
        job.state = "Done"

    monkeypatch.setattr("belt_sim.app.session.Job.run", nothing)
    in_loop(session.work("diagnose"))
    (job,) = session.jobs
    assert job.settings["model"] == "by_tension"  # which the command resolves
    assert job.title.endswith(f", {model}")
