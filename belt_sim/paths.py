"""Where things of this checkout stand."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CONF = ROOT / "conf"
MODELS = ROOT / "models"
CAMPAIGNS = MODELS / "campaigns"
