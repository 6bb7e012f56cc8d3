"""The five laws that a belt model is composed of: span, run-up, wrap, drive, sensor."""
