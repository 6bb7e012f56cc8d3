"""What a model is to everybody else: it refuses effects that it cannot represent, and runs a case.

Two kinds: a ``Model`` gives curves against travel; a ``SteadyModel`` is a formula for the late rate alone. They are
told apart by type (``isinstance``), never by name.
"""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.frame import Observer


@runtime_checkable
class Model(Protocol):
    """A belt that can be run.

    name, title: as in configurations, and in words; contains: ids of effects that are built in; outputs: names of the
    arrays of ``Curves`` that it fills.
    """

    @property
    def name(self) -> str: ...

    @property
    def title(self) -> str: ...

    @property
    def contains(self) -> frozenset[str]: ...

    @property
    def outputs(self) -> frozenset[str]: ...

    def refusal(self, effect: Any) -> str | None:
        """Why this model cannot represent an effect (or a class of effects); None when it can."""

    def admit(self, effects: Sequence[Any]) -> None:
        """Raise CannotRepresent for the first effect that this model cannot represent."""

    def run(
        self, case: Case, effects: Sequence[Any] = (), *, travel: float, observers: Sequence[Observer] = ()
    ) -> Curves:
        """Curves over ``travel`` [m] as the instruments indicate them.

        Effects on the drive change what is commanded, those of the belt and the pulleys the run itself, those of
        encoder and sensors what is read. Raises CannotRepresent, InputError, SimulationError.
        """


@runtime_checkable
class SteadyModel(Protocol):
    """A formula for the late rate, without curves and without effects."""

    @property
    def name(self) -> str: ...

    @property
    def title(self) -> str: ...

    def refusal(self, effect: Any) -> str | None:
        """Why it cannot represent an effect: it reads none."""

    def steady_rate(self, case: Case) -> float:
        """Late drift w = dy/ds of all four points [m/m]."""
