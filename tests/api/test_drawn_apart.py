"""Pictures of a diagnosis are drawn by processes beside it, as soon as there is something to draw."""

from dataclasses import replace

import pytest
from small_campaign import drawn

from belt_sim.errors import BeltError
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


def test_nothing_is_drawn_of_a_diagnosis_that_failed():
    with pytest.raises(ZeroDivisionError), drawing_apart():
        raise ZeroDivisionError
