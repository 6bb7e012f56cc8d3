"""Catalogue of physical effects: one file an effect; see base.py for how to write one."""
