"""A local web page for people who do not use terminals: simulate with sliders, compare and diagnose own measurements.

It is served on the loopback address only, by NiceGUI (the extra ``app``). ``guard`` says who may speak to the server,
``intray`` what becomes of dropped files, ``jobs`` and ``worker`` how long work runs beside the page.
"""
