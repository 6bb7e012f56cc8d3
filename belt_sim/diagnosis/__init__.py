"""Compare a model with measurements, see where it fails, learn which effect is missing.

``examine`` goes through all of it, ``search`` says which sets of effects are worth a joint fit, ``describe`` and
``drawings`` hand out the findings, ``next_run`` proposes a further run; ``admission`` tests a user's own effect. They
stand on these parts, each of which knows those before it and no other: ``readings`` (measured and predicted),
``noise``, ``fits``, ``errors`` (how far a model is off), ``decision`` (one table of evidence and one score).
"""
