"""Observers: whoever watches a run from outside. The core imports none of them."""
