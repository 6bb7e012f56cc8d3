"""How fast the models are, each figure beside a plain way of doing the same."""
