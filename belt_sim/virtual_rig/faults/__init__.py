"""Faults that a fitter may know, one a file: each the independent twin of an effect, on the line and in the scene."""
