"""The line model: the laws of spans and run-ups, their march in travel, steady rates in closed form."""
