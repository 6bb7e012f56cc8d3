"""A run: its stages in order, one step of it, and what is measured and recorded."""
