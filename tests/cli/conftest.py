"""``belt`` calls the command line."""

import sys

import pytest
from command import Shell


@pytest.fixture
def belt(tmp_path, capsys, monkeypatch):
    """A Shell; sys.argv and the environment are put back afterwards."""
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    return Shell(tmp_path / "run", capsys)
