"""``belt`` calls the command line in this process, as in tests/cli."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "cli"))
from command import Shell


@pytest.fixture
def belt(tmp_path, capsys, monkeypatch):
    """A Shell; sys.argv and the environment are put back afterwards."""
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    return Shell(tmp_path / "run", capsys)
