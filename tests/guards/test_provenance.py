"""A result names the commit of this checkout, and never that of a repository that merely surrounds the package."""

import subprocess

import pytest

from belt_sim import io
from belt_sim.io import ROOT


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no checkout of a repository")
def test_the_commit_is_that_of_the_checkout(monkeypatch):
    head = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    assert io.provenance()["commit"] == head.stdout.strip()
    inside = ROOT / "outputs"  # lies in this repository and is none itself, as site-packages may
    monkeypatch.setattr(io, "ROOT", inside)
    io.code_origin.cache_clear()
    try:
        assert io.provenance()["commit"] is None
    finally:
        io.code_origin.cache_clear()
