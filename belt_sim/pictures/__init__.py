"""Pictures of curves and of what a diagnosis found: one idea a file, physical units on every axis."""

from belt_sim.pictures.bode import bode_picture
from belt_sim.pictures.curves import Rates, curves_picture, rates_picture, steady_picture, understood_picture
from belt_sim.pictures.diagnosis import (
    drift_chart_picture,
    evidence_picture,
    falling_error_picture,
    law_picture,
    overlay_picture,
    ranking_picture,
    unknown_picture,
    where_map_picture,
)
from belt_sim.pictures.style import save

__all__ = [
    "Rates",
    "bode_picture",
    "curves_picture",
    "drift_chart_picture",
    "evidence_picture",
    "falling_error_picture",
    "law_picture",
    "overlay_picture",
    "ranking_picture",
    "rates_picture",
    "save",
    "steady_picture",
    "understood_picture",
    "unknown_picture",
    "where_map_picture",
]
