"""A small campaign folder that is right in everything, for tests to damage."""

from pathlib import Path

SHEET = """\
schema: belt-campaign/1
title: slack belt
source: {kind: measured, reference: "log book 7", licence: "CC-BY-4.0"}
machine:
  centre_distance: {value: 11.28, u: 0.005, unit: m}
  pulley_radius: {value: 0.170, u: 0.0005, unit: m}
belt:
  width: {value: 200, u: 0.1, unit: mm}
  thickness: {value: 0.3, u: 0.003, unit: mm}
  youngs_modulus: {value: 210, u: 4, unit: GPa}
  density: {value: 7850, unit: kg/m^3}
  poisson_ratio: {value: 0.3}
signals:
  y1: {unit: mm, at: point_1, white: 0.02, zero: 0.1, gain: 0.01, wander: {sd: 0.05, length_m: 3}}
  y4: {unit: mm, at: point_4, white: 0.02}
  tilt: {unit: mrad, at: upper_mid_span, white: 0.1}
settings: {tension_rel: 0.01, yaw: {u: 3, unit: urad}}
"""
RUNS = """\
run,tension_N_per_mm2,yaw_deg,yaw_head_deg,speed_m_per_s,direction,yaw_at_m,repeat_of,use
r01,10,-0.042,0,0.5,1,0,,fit
r02,10,-0.042,,,,,r01,hold_out
r03,40,0.042,0.01,0.25,-1,0.1,,
"""
SIGNALS = """\
run,travel_m,time_s,y1,y4,tilt
r01,0.0,0.0,0.012,-0.003,
r01,0.1,0.2,0.013,,0.5
r02,0.0,,0.01,0.002,0.1
r02,0.1,,0.02,0.003,0.2
r03,0.0,,0.02,0.003,
r03,0.2,,0.03,0.004,
"""
STEADY = """\
run,rate1,rate4,u_rate
r01,-0.094,-0.095,0.002
r03,0.152,,0.002
"""


class Folder:
    """A campaign folder whose texts can be edited."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.mkdir()
        for name, text in (
            ("campaign.yaml", SHEET),
            ("runs.csv", RUNS),
            ("signals.csv", SIGNALS),
            ("steady.csv", STEADY),
        ):
            self.write(name, text)

    def write(self, name: str, text: str | bytes) -> None:
        (self.path / name).write_bytes(text if isinstance(text, bytes) else text.encode())

    def edit(self, name: str, old: str, new: str) -> None:
        """Replace ``old`` by ``new``, which must occur."""
        text = (self.path / name).read_text()
        assert old in text
        self.write(name, text.replace(old, new, 1))
