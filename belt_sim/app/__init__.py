"""A local web page for people who do not use terminals: simulate with sliders, compare and diagnose measurements.

NiceGUI (the extra ``app``) serves it on the loopback address only. ``security`` decides which requests pass, ``upload``
sorts dropped files, ``jobs`` and ``worker`` run long work in a process of its own.
"""
