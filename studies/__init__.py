"""Studies beside the product: what the 3D belt costs and how exact it is, how often the diagnosis is right."""
