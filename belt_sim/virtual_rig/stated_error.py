"""What the campaign file states of errors when the rig is itself a simulation with an error of its own."""

from dataclasses import replace

from belt_sim.virtual_rig.plan import Noise

#: Engine -> a share of every reading, and what wanders beside it [m]: how far a campaign with nothing hidden is off the
#: 1D line, mesh and law together (python -m studies.space_error). The worst signal is stated: this error is the same in
#: every repeat, where a diagnosis cannot see it. native: the best factor of a signal is 1.0 % off 1 (rms; 2.4 % at
#: most), what it leaves over is 1.6 um (2.7 um at most); quasi_static: 0.3 % (0.5 at most), 1.6 um (1.8 at most).
OWN_ERROR = {"native": (0.02, 3e-6), "quasi_static": (0.005, 2e-6)}


def with_simulator_error(sensors: Noise, engine: str = "native") -> tuple[Noise, str]:
    """The sensors' noise with the simulator's own error added in squares, and a sentence for the file."""
    gain, wander = OWN_ERROR[engine]
    stated = replace(
        sensors,
        gain=(sensors.gain**2 + gain**2) ** 0.5,
        wander_sd=(sensors.wander_sd**2 + wander**2) ** 0.5,
    )
    return stated, f"gain and wander cover the simulator's own error ({gain:.1%} of a reading, {wander * 1e6:g} um)"
