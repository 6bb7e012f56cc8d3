"""The written effect is a file that stands by itself, whatever kind of number the search had in hand."""

import numpy as np
from small_discovery import surveyed

from belt_sim.discovery.effect_file import written
from belt_sim.discovery.forms import Form
from belt_sim.discovery.survey import Law, Term


def test_numbers_of_numpy_are_written_as_plain_numbers():
    place = next(p for p in surveyed("yaw_creep").places if p.kind == "yaw" and len(p.parts) == 1)
    form = Form("one", course="fade", at=np.float64(3.0))
    law = Law((Term(place, form, exponent=np.float64(-1.0)),))
    made = written(law, np.array([1e-4]), np.float64(1e7), said="A test.", points={}, final=True)
    assert "np.float" not in made.text
    assert vars(made.cls())["at"] == 3.0
