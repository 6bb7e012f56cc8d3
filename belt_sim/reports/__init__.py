"""The report of a diagnosis: one HTML file that needs no network."""
