"""Several observers as one."""

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.frame import Frame, Observer


class Together:
    """Hands everything on to each of its observers, in order."""

    def __init__(self, *observers: Observer) -> None:
        self.observers = observers

    def start(self, case: Case, travel: float) -> None:
        """A run begins."""
        for observer in self.observers:
            observer.start(case, travel)

    def frame(self, frame: Frame) -> None:
        """A new instant."""
        for observer in self.observers:
            observer.frame(frame)

    def finish(self, curves: Curves) -> None:
        """The run has ended."""
        for observer in self.observers:
            observer.finish(curves)
