"""Faults that a fitter may know, by where they act: each the independent twin of an effect, on the line and in the
scene.
"""

from belt_sim.virtual_rig.reference_effects import belt, contact, drive, pulley, sensor, span, yaw

MODULES = (belt, contact, drive, pulley, sensor, span, yaw)
