"""Faults that no catalogue lists, by where they act: what an open-set test hides."""

from belt_sim.virtual_rig.unmodelled import contact, drive, pulley, sensor, span, stiffness, yaw

MODULES = (contact, drive, pulley, sensor, span, stiffness, yaw)
