"""The search: joint fits of sets of effects, the likeliest first."""
