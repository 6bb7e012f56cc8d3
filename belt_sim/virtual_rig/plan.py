"""What is measured on the virtual rig: the machine's data sheet, the runs, the sensors, the noise."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from belt_sim.campaign import BeltSheet, Machine, Quantity, SignalSheet
from belt_sim.campaign.types import kind_at
from belt_sim.units import DEGREE, MM, N_PER_MM2

#: The paper's test rig; E, rho and nu are not given there and assumed (physics sheet, section 1).
TEST_RIG = Machine(
    centre_distance=Quantity(value=11.28, u=0.005),
    head_radius=Quantity(value=0.170, u=0.0005),
    tail_radius=Quantity(value=0.170, u=0.0005),
)
TEST_BELT = BeltSheet(
    width=Quantity(value=0.2, u=1e-4),
    thickness=Quantity(value=3e-4, u=3e-6),
    youngs_modulus=Quantity(value=210e9, u=4e9),
    density=Quantity(value=7850.0),
    poisson_ratio=Quantity(value=0.3),
)
TEST_TENSIONS = (7.0 * N_PER_MM2, 10.0 * N_PER_MM2, 20.0 * N_PER_MM2, 40.0 * N_PER_MM2)
TEST_YAWS = (-0.042 * DEGREE, 0.042 * DEGREE)


@dataclass(frozen=True, kw_only=True)
class RunSetting:
    """What a run is set to [SI], as in ``campaign.Run``; repeat_of: index of the first such run.

    start: travel that the belt had behind it when the record began, which no file states.
    """

    tension: float
    yaw: float
    yaw_head: float = 0.0
    speed: float = 0.5
    direction: float = 1.0
    yaw_at: float = 0.0
    repeat_of: int | None = None
    start: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The runs, each recorded over ``length`` at every ``spacing`` [m]; signals: name -> place.

    zero_at_start: a lateral sensor is set to zero where the record begins, and not where the yaw is applied.
    """

    runs: tuple[RunSetting, ...] = field(default_factory=lambda: grid(TEST_TENSIONS, TEST_YAWS))
    length: float = 60.0
    spacing: float = 0.25
    signals: dict[str, str] = field(default_factory=lambda: {"y1": "point_1", "y4": "point_4"})
    machine: Machine = TEST_RIG
    belt: BeltSheet = TEST_BELT
    zero_at_start: bool = False

    def __hash__(self) -> int:
        values = vars(self) | {"signals": tuple(self.signals.items())}
        return hash(tuple(values.values()))

    @property
    def travel(self) -> np.ndarray:
        """Where readings are taken, as the recorder shows it [m], shape (n,)."""
        count = math.floor(self.length / self.spacing + 1e-9)
        return np.round(self.spacing * np.arange(count + 1), 9)

    @property
    def belt_length(self) -> float:
        """Length of the endless belt [m]."""
        machine = self.machine
        return 2 * machine.centre_distance.value + np.pi * (machine.head_radius.value + machine.tail_radius.value)

    @property
    def duration(self) -> float:
        """Time of the first run [s]."""
        return self.length / self.runs[0].speed

    @property
    def largest_yaw(self) -> float:
        """Of the tail pulley, either way [rad]."""
        return max(abs(run.yaw) for run in self.runs)

    @property
    def largest_speed(self) -> float:
        """Of any run [m/s]."""
        return max(run.speed for run in self.runs)

    @property
    def excursion(self) -> float:
        """How far the belt may come in the record [m]: a sixth of what a rope would make of its largest yaw."""
        return self.largest_yaw * self.length / 6 + 1e-4


def grid(tensions: Sequence[float], yaws: Sequence[float], repeats: int = 2) -> tuple[RunSetting, ...]:
    """Every tension at every yaw; then ``repeats`` of these runs, evenly picked, once more."""
    first = [RunSetting(tension=t, yaw=y) for t in tensions for y in yaws]
    picked = np.linspace(0, len(first) - 1, repeats + 2)[1:-1].round().astype(int)
    again = [RunSetting(tension=first[k].tension, yaw=first[k].yaw, repeat_of=int(k)) for k in picked]
    return (*first, *again)


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What the campaign file states of the errors [SI, one sigma], and how the true ones differ.

    scale: true white noise and wander over the stated ones; heavy_tails: Student's t with 3 degrees of
    freedom instead of Gauss for the white noise, of equal variance; true_length: of the wander, None = as stated;
    smooth: the wander has a slope (Matern 3/2) instead of an Ornstein-Uhlenbeck process's kinks; quantum: step of the
    lateral readings [m], which the file states as part of their white noise; zero: of a signal, drawn for every run.
    """

    white: float = 0.02 * MM
    zero: float = 0.1 * MM
    gain: float = 0.0
    wander_sd: float = 0.05 * MM
    wander_length: float = 3.0
    tilt_white: float = 1e-4
    tension_rel: float = 0.01
    yaw_u: float = 3e-6
    scale: float = 1.0
    heavy_tails: bool = False
    true_length: float | None = None
    smooth: bool = False
    quantum: float = 0.0

    def sheets(self, plan: Plan) -> tuple[SignalSheet, ...]:
        """What the file states of every signal of a plan."""
        errors = {n: getattr(self, n) for n in ("white", "zero", "gain", "wander_sd", "wander_length")}
        errors["white"] = math.hypot(self.white, self.quantum / math.sqrt(12.0))
        return tuple(
            SignalSheet(name=name, at=place, kind="lateral", unit="mm", **errors)
            if kind_at(place) == "lateral"
            else SignalSheet(name=name, at=place, kind="tilt", unit="mrad", white=self.tilt_white)
            for name, place in plan.signals.items()
        )
