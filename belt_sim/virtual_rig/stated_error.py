"""What the campaign file states of errors when the rig is itself a simulation with an error of its own."""

from dataclasses import replace

from belt_sim.virtual_rig.plan import Noise

#: A share of every reading, and what wanders beside it [m]. Over the runs of a campaign with nothing hidden, against
#: the 1D line, the best factor of a signal is 1.0 % off 1 (rms; 2.4 % at most), and what it leaves over is 1.6 um
#: (2.7 um at most). The worst is stated: this error is the same in every repeat, where a diagnosis cannot see it.
GAIN, WANDER = 0.02, 3e-6


def with_simulator_error(sensors: Noise) -> tuple[Noise, str]:
    """The sensors' noise with the simulator's own error added in squares, and a sentence for the file."""
    stated = replace(
        sensors,
        gain=(sensors.gain**2 + GAIN**2) ** 0.5,
        wander_sd=(sensors.wander_sd**2 + WANDER**2) ** 0.5,
    )
    return stated, f"gain and wander cover the simulator's own error ({GAIN:.1%} of a reading, {WANDER * 1e6:g} um)"
