"""Where what travels with the package stands: at the top of a checkout, or inside an installed package."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
ROOT = PACKAGE.parent  # of a checkout
INSTALLED = (PACKAGE / "_shipped").is_dir()
_TOP = PACKAGE / "_shipped" if INSTALLED else ROOT
CONF = _TOP / "conf"
MODELS = _TOP / "models"
CAMPAIGNS = MODELS / "campaigns"
