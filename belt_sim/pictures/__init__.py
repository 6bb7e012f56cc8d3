"""Pictures of curves and of what a diagnosis found: one idea a file, physical units on every axis."""
