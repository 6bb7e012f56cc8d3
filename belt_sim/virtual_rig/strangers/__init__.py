"""Faults that no catalogue lists, one a file: what an open-set test hides."""
