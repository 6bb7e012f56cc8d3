"""What acts on the nodes: loads return forces and guides give springs, which run/engine.py puts together."""
