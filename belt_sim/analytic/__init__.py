"""Analytic belt models: marches in belt travel and closed forms."""
