"""Compare a model with measurements, see where it fails, learn which effect is missing.

``examine`` goes through all of it, ``search`` says which sets of effects are worth a joint fit, ``decide`` holds the
table of evidence and the score, ``describe`` hands out the findings. No file imports one that stands above it
(``STOREYS`` in tests/guards/test_house_rules.py).
"""
