"""A real web over rollers, by the span law and the run-up law of the belt."""
