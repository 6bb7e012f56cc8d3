"""Campaigns of the independent generator on small plans, as for the diagnosis."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "diagnose"))
