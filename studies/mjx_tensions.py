"""Tensions in one call of MJX beside the strip law: ``python -m studies.mjx_tensions [COUNT RIG TRAVEL PICTURE]``.

Without arguments: 64 of them on the short rig over 2 m, and no picture.
"""

import sys
import time
from pathlib import Path

import jax
import numpy as np

import belt_sim as bs
from belt_sim.curves import Curves
from belt_sim.errors import SimulationError
from belt_sim.jax_setup import prepare
from belt_sim.settings import make_case
from belt_sim.show import style
from belt_sim.show.style import BLUE, RED
from belt_sim.units import MM

YAW = -0.005  # deg: one at which the slackest edge of the short rig stays under tension
TENSIONS = (7.0, 60.0)  # N/mm2
PLACES = (0.25, 0.5, 1.0)  # of the travel


def at_places(curves: Curves, travel: float) -> np.ndarray:
    """y of points 1 and 3 at PLACES [mm], (2, 3)."""
    return np.array([[np.interp(s * travel, curves.travel, curves.y[p]) for s in PLACES] for p in (0, 2)]) / MM


@style.picture
def draw(path: Path, tensions: np.ndarray, y: np.ndarray, law: np.ndarray, travel: float) -> Path:
    """Points 1 and 3 over the tension: MJX (dots) on the strip law (lines); y, law (cases, 2, 3)."""
    fig, axes = style.figure(9.0, 3.6, 1, 2, sharex=True)
    for panel, (point, colour) in enumerate(((1, BLUE), (3, RED))):
        ax = axes[0][panel]
        for k, place in enumerate(PLACES):
            named = ("strip law", "MJX") if k == 0 else (None, None)
            ax.plot(tensions, law[:, panel, k], color=colour, alpha=0.3, linewidth=4.0, label=named[0])
            ax.plot(tensions, y[:, panel, k], ".", color=colour, markersize=4.0, label=named[1])
            beside = {"xytext": (3, 0), "textcoords": "offset points", "fontsize": 7}
            ax.annotate(f"{place * travel:g} m", (tensions[-1], y[-1, panel, k]), **beside)
        ax.set_title(f"Point {point}")
        ax.set_xlabel("tension [N/mm$^2$]")
    axes[0][0].set_ylabel("y [mm]")
    axes[0][0].legend(fontsize=7)
    style.title(fig, f"{len(tensions)} belts on MJX in one call beside the strip law (yaw {YAW:g} deg)")
    return style.save(fig, path)


def main(count: int = 64, rig: str = "rope_example", travel: float = 2.0, picture: Path | None = None) -> None:
    """Run, say how long it took and how far the law is off, draw."""
    begun, cpu = time.perf_counter(), time.process_time()
    prepare(space=True)
    from belt_sim.mjx import simulate_batch

    tensions = np.linspace(*TENSIONS, count)
    cases = [make_case(rig=rig, tension=float(t), yaw=YAW, travel=travel) for t in tensions]
    found = simulate_batch(cases, travel=travel, chunk=count)
    took, cpu = time.perf_counter() - begun, time.process_time() - cpu
    failed = [t for t, c in zip(tensions, found, strict=True) if isinstance(c, SimulationError)]
    peak = (jax.devices()[0].memory_stats() or {}).get("peak_bytes_in_use", 0)
    said = f"{took:.0f} s, {cpu:.0f} CPU s, {peak / 1e9:.2f} GB, failed: {failed}"
    print(f"{count} belts, {rig}, {travel:g} m, on {jax.devices()[0]}: {said}", flush=True)
    y = np.array([at_places(c, travel) for c in found if not isinstance(c, SimulationError)])
    laws = [bs.simulate(c, model="strip", travel=travel + 0.1).curves for c in cases]
    law = np.array([at_places(c, travel) for c in laws if c is not None])
    off = 100.0 * np.abs(y - law).max(axis=(1, 2)) / np.abs(law).max(axis=(1, 2))
    for k in range(0, count, max(count // 8, 1)):
        print(f"| {tensions[k]:.1f} | {y[k, 0, -1]:.4f} | {law[k, 0, -1]:.4f} | {off[k]:.2f} % |")
    print(f"strip law and MJX differ by {off.max():.2f} % of the largest y at most")
    if picture is not None:
        print(draw(picture, tensions, y, law, travel))


if __name__ == "__main__":
    given = [kind(text) for kind, text in zip((int, str, float, Path), sys.argv[1:], strict=False)]
    main(*given)
