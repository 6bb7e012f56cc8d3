"""Compare a model with measurements, see where it fails, learn which effect is missing.

``examine`` goes through all of it, ``describe`` and ``drawings`` hand out what it found; ``admission`` tests a user's
own effect. They stand on these parts, each of which knows those before it and no other: ``numerics``, ``readings``
(measured and predicted), ``noise``, ``fits``, ``errors`` (how far a model is off), ``left_over`` (what is left when
effects are in), ``choice`` (which effects are missing), ``answer`` (what is told).
"""
