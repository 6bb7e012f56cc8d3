"""A local web page for people who do not use terminals: simulate with sliders, compare and diagnose measurements.

NiceGUI (the extra ``app``) serves it on the loopback address only. ``upload`` sorts dropped files, ``jobs`` runs long
work in a process of its own.
"""
