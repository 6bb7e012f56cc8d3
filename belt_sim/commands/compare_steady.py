"""Comparing steady rates (steady.csv), as published tables give them."""

from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim import si
from belt_sim.analytic.march import march
from belt_sim.analytic.model import AnalyticModel
from belt_sim.analytic.ritzinger import RitzingerFormula
from belt_sim.campaign import Campaign, case_of
from belt_sim.curves import late_rates

TRAVEL = 300.0  # [m]; the strip's transient at 7 N/mm2 is longer than 100 m
K = 2.0


def compare_steady(campaign: Campaign, model: AnalyticModel | RitzingerFormula, effects) -> list[dict[str, Any]]:
    """Measured and modelled late rates of every run in steady.csv [mm per m], E/u where u is the stated one."""
    runs = {r.name: r for r in campaign.runs}
    rows = []
    for stated in campaign.steady:
        case = case_of(campaign, runs[stated.run])
        if effects and isinstance(model, AnalyticModel):
            rates = late_rates(march(case, model, effects, travel=TRAVEL))
        else:
            rates = np.full(4, model.steady_rate(case))
        for point, (measured, modelled) in enumerate(zip(stated.rates, rates, strict=True), start=1):
            if np.isfinite(measured):
                rows.append(
                    {
                        "run": stated.run,
                        "point": point,
                        "tension": runs[stated.run].tension / si.N_PER_MM2,
                        "measured_mm_per_m": float(measured) / si.MM_PER_M,
                        "modelled_mm_per_m": float(modelled) / si.MM_PER_M,
                        "u_mm_per_m": stated.u / si.MM_PER_M,
                        "ratio": float(abs(modelled - measured) / stated.u),
                    }
                )
    return rows


def tell_steady(rows: list[dict[str, Any]], name: str) -> None:
    """The rates as a table; red where the model is off by more than K u."""
    table = Table(title=f"steady rates in mm per m, {name}", title_justify="left")
    for heading in ("run", "point", "N/mm2", "measured", "u", "modelled", "|E|/u"):
        table.add_column(heading, justify="right")
    for r in rows:
        numbers = [f"{r[k]:.4f}" for k in ("measured_mm_per_m", "u_mm_per_m", "modelled_mm_per_m")]
        cells = [r["run"], str(r["point"]), f"{r['tension']:g}", *numbers, f"{r['ratio']:.1f}"]
        table.add_row(*cells, style="red" if r["ratio"] > K else None)
    Console(highlight=False).print(table)


def draw_steady(path: Path, rows: list[dict[str, Any]], name: str, title: str) -> Path:
    """Late rate of the first measured point against tension, measured and modelled."""
    from belt_sim.pictures import Rates, rates_picture

    point = min(r["point"] for r in rows)
    mine = sorted((r for r in rows if r["point"] == point), key=lambda r: r["tension"])
    tension = np.array([r["tension"] for r in mine])
    modelled = Rates(tension=tension, rate=np.array([r["modelled_mm_per_m"] for r in mine]))
    u = np.array([r["u_mm_per_m"] for r in mine])
    measured = Rates(tension=tension, rate=np.array([r["measured_mm_per_m"] for r in mine]), u=u)
    return rates_picture(path, {name: modelled}, title, measured=measured)
