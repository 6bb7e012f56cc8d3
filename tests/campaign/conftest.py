"""A campaign folder in a temporary place."""

from pathlib import Path

import pytest
from sample_campaign import Folder


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path / "slack")
