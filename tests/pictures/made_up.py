"""Made-up inputs of every picture, with the shapes that they document."""

import numpy as np

from belt_sim.curves import Curves
from belt_sim.pictures import Drift, FailureMap, Panel, Rates

TENSIONS = np.array([7.0, 10.0, 20.0, 30.0, 40.0])


def curves(rate: float = -1.2e-4) -> Curves:
    """Points that swing in and drift."""
    s = np.linspace(0.0, 60.0, 601)
    rise = 1.0 - np.exp(-s / 6.0)
    lag = np.array([1.0, 0.93, 0.15, 0.05])[:, None]
    return Curves(travel=s, y=rate * s * rise - lag * 3.2e-3 * rise)


def panels(count: int = 6, final: bool = True) -> list[Panel]:
    """Runs whose base model is worse at low tension."""
    rng, out = np.random.default_rng(3), []
    for k in range(count):
        s, tension = np.linspace(0.0, 60.0, 240), TENSIONS[(k // 2) % len(TENSIONS)]
        right = -0.12 * s - (3.0 if k % 2 == 0 else 0.2) * (1 - np.exp(-s * tension / 90.0))
        base = -0.12 * s - (3.0 if k % 2 == 0 else 0.2) * (1 - np.exp(-s / 3.0))
        measured = right + rng.normal(0, 0.05, s.shape)
        measured[100:110] = np.nan
        label = f"r{k // 2 + 1:02d} y{1 + 3 * (k % 2)}, {tension:g} N/mm²"
        band = 0.15 + 0.004 * s
        fin = right if final else None
        out.append(Panel(title=label, travel=s, measured=measured, base=base, final=fin, band=band))
    return out


def maps() -> list[FailureMap]:
    """E/u_val that grows towards low tension and early travel; one cell was not measured."""
    edges, out = np.arange(0.0, 61.0, 10.0), []
    for signal, strength in (("y1", 14.0), ("y4", 4.0)):
        for sign in (-1, 1):
            ratio = -sign * strength * (10 / TENSIONS)[:, None] ** 1.5 * np.exp(-np.arange(6) / 3.0)[None]
            ratio[3, 5] = np.nan
            out.append(
                FailureMap(
                    title=f"{signal}, yaw {'+' if sign > 0 else '-'}",
                    tension=TENSIONS,
                    edges=edges,
                    ratio=ratio,
                )
            )
    return out


def drifts() -> list[tuple[Drift, Drift]]:
    """A stiffness that must fall with tension before, and stays put after."""
    u = np.array([4.0, 4.0, 5.0, 6.0, 8.0])
    common = {"parameter": "Young's modulus", "unit": "GPa", "tension": TENSIONS, "u": u}
    before = Drift(value=np.array([60.0, 95.0, 160.0, 185.0, 198.0]), stated=210.0, u_stated=4.0, **common)
    after = Drift(value=np.array([207.0, 214.0, 209.0, 206.0, 213.0]), **common)
    common = {"parameter": "yaw", "unit": "urad", "tension": TENSIONS, "u": 6 * np.ones(5)}
    before2 = Drift(value=np.array([-500.0, -560.0, -690.0, -720.0, -730.0]), stated=-733.0, u_stated=3.0, **common)
    after2 = Drift(value=np.array([-735.0, -728.0, -741.0, -730.0, -736.0]), **common)
    return [(before, after), (before2, after2)]


def rates() -> tuple[dict[str, Rates], Rates]:
    """The late rates of the test rig at |yaw| = 0.042 deg (closed forms), and made-up measurements."""
    t = np.array([7.0, 10.0, 20.0, 40.0, 60.0])
    models = {
        "rope": Rates(tension=t, rate=np.full(5, 0.34995)),
        "beam Th1": Rates(tension=t, rate=np.full(5, 0.11665)),
        "beam Th2": Rates(tension=t, rate=np.array([0.12611, 0.12992, 0.14165, 0.16140, 0.17800])),
        "strip": Rates(tension=t, rate=np.array([0.11764, 0.09419, 0.10409, 0.15201, 0.17469])),
    }
    return models, Rates(tension=t[1:4], rate=np.array([0.10, 0.11, 0.15]), u=np.array([0.008, 0.005, 0.004]))


def ranking() -> list[dict]:
    """Two effects that explain, and some that do not."""
    gains = {
        "sag_roll": 5120.0,
        "yaw_compliance": 212.0,
        "taper": 40.0,
        "soft_cover": 8.0,
        "cant": 3.1,
        "slip": 0.0,
    }
    return [{"id": k, "gain": g, "threshold": 9.1} for k, g in gains.items()]
