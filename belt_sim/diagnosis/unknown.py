"""The seam for what no effect of the library is: what a search for unknown laws hands to the verdict."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.workbench import Workbench


class Unknown(Protocol):
    """What is seen beside a fit."""

    @property
    def failed(self) -> tuple[str, ...]:
        """Tests by which something is left that chance does not explain; empty when nothing is."""

    def columns(self) -> np.ndarray:
        """Shapes (k, R, S, n) of what is left, to refit effects beside it; none where nothing was found."""


#: (workbench, fit, whether another test has shown already that something is left) -> what is seen beside the fit
Look = Callable[[Workbench, Fit, bool], Unknown]
