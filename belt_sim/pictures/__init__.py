"""Pictures of curves and of what a diagnosis found: one idea a file, physical units on every axis."""

from belt_sim.pictures.bode import bode_picture
from belt_sim.pictures.curves import curves_picture
from belt_sim.pictures.discovery import (
    evidence_picture,
    falling_error_picture,
    law_picture,
    unknown_picture,
)
from belt_sim.pictures.drift_chart import drift_chart_picture
from belt_sim.pictures.overlay import overlay_picture
from belt_sim.pictures.ranking import ranking_picture
from belt_sim.pictures.rates import Rates, rates_picture
from belt_sim.pictures.score import confusion_picture, reliability_picture
from belt_sim.pictures.steady import steady_picture
from belt_sim.pictures.where import where_map_picture

__all__ = [
    "Rates",
    "bode_picture",
    "confusion_picture",
    "curves_picture",
    "drift_chart_picture",
    "evidence_picture",
    "falling_error_picture",
    "law_picture",
    "overlay_picture",
    "ranking_picture",
    "rates_picture",
    "reliability_picture",
    "steady_picture",
    "unknown_picture",
    "where_map_picture",
]
