"""Pictures of a diagnosis are drawn by processes beside it, as soon as there is something to draw."""

import os
import subprocess
import time
from dataclasses import replace

import pytest
from small_campaign import drawn

from belt_sim.errors import BeltError
from belt_sim.files import clear_drafts
from belt_sim.use_cases.draw_apart import drawing_apart

FILES = {"overlay.png", "headline.png", "where.png", "ranking.png", "drift_1.png"}


def test_all_is_drawn_once_however_often_a_result_comes(tmp_path):
    first, later = tmp_path / "first", tmp_path / "later"
    first.mkdir()
    later.mkdir()
    found = replace(drawn("sag_roll"), discovery=None)
    with drawing_apart() as draw:
        draw(first, found)
        draw(later, found)
    assert {path.name for path in first.iterdir()} == FILES
    assert not list(later.iterdir())


@pytest.mark.parametrize("blocked", ["overlay.png", "ranking.png"])
def test_a_picture_that_cannot_be_drawn_is_told(tmp_path, blocked):
    (tmp_path / blocked).mkdir()
    with pytest.raises(BeltError, match=blocked), drawing_apart() as draw:
        draw(tmp_path, drawn("sag_roll"))


def test_a_diagnosis_that_is_stopped_leaves_no_pictures(tmp_path):
    """Not even those that were drawn already."""
    with pytest.raises(KeyboardInterrupt):
        _stopped_while_drawing(tmp_path)
    assert not list(tmp_path.iterdir())


def _stopped_while_drawing(folder):
    with drawing_apart() as draw:
        draw(folder, drawn("sag_roll"))
        while not list(folder.glob("*/*.png")):
            time.sleep(0.05)
        raise KeyboardInterrupt


def test_pictures_of_a_diagnosis_that_was_killed_are_cleared_away(tmp_path):
    process = subprocess.Popen(["true"])
    process.wait()
    for name in (f".pictures.{process.pid}", f".pictures.{os.getpid()}", ".mine.1"):
        (tmp_path / name).mkdir()
    clear_drafts(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {f".pictures.{os.getpid()}", ".mine.1"}
