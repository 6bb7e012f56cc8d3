"""Sample campaigns go by their bare names; a folder of that name comes first."""

import pytest

from belt_sim.campaign import read_campaign
from belt_sim.campaign.folder import campaign_folder
from belt_sim.campaign.types import CampaignError
from belt_sim.io import CAMPAIGNS, sample_campaigns
from belt_sim.virtual_rig.make import reveal


def test_a_shipped_campaign_needs_no_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert read_campaign("slack_belt").sha256 == read_campaign(CAMPAIGNS / "slack_belt").sha256
    assert [e["id"] for e in reveal(campaign_folder("slack_belt")).effects] == ["sag_roll"]


def test_a_folder_of_that_name_comes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slack_belt").mkdir()
    assert not campaign_folder("slack_belt").is_absolute()
    with pytest.raises(CampaignError, match="missing in slack_belt"):
        read_campaign("slack_belt")


def test_an_unknown_name_is_told_which_ship(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CampaignError, match=", ".join(sample_campaigns())) as told:
        read_campaign("slak_belt")
    assert len(str(told.value).splitlines()) == 1
    with pytest.raises(CampaignError):
        read_campaign("../campaigns/slack_belt")
