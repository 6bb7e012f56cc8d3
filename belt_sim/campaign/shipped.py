"""The sample campaigns that travel with the package can be named without their path."""

from pathlib import Path

from belt_sim.paths import CAMPAIGNS


def shipped() -> list[str]:
    """Names of the campaigns that ship."""
    return sorted(p.parent.name for p in CAMPAIGNS.glob("*/campaign.yaml"))


def campaign_folder(named: str | Path) -> Path:
    """The folder that is named: as it stands, else the shipped campaign of that bare name."""
    folder = Path(named)
    return CAMPAIGNS / folder if not folder.exists() and str(named) in shipped() else folder
