"""Compare a model with measurements, see where it fails, learn which effect is missing."""
