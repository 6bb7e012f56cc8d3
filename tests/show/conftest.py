"""Pictures and reports are made of the small campaigns of the diagnosis' own tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "diagnose"))
