"""Which campaign a result is about."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class CampaignLabel:
    """Which campaign: title, SHA-256 of its files (empty when not read from disk), measured, digitised or synthetic."""

    title: str
    sha256: str
    source: str
