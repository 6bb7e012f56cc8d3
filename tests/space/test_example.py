"""The controller of the notebook examples/batch_on_mjx.ipynb, a tiny version of it."""

import json

import numpy as np
import pytest

from belt_sim.io import ROOT


@pytest.mark.long
def test_the_controller_turns_the_tail_against_y():
    """Of two equal belts the steered one moves less."""
    notebook = json.loads((ROOT / "examples" / "batch_on_mjx.ipynb").read_text(encoding="utf-8"))
    code = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    names: dict = {}
    exec("\n".join([code[0], code[1].split("\n\n\ny = ")[0]]), names)  # its imports and its function
    steered = names["steered"]
    y = steered(np.array([0.0, 2e-3]), np.array([0.04, 0.04]), 900)
    assert y.shape == (2, 900)
    assert 0.0 < np.abs(y[1, -1]) < np.abs(y[0, -1])
