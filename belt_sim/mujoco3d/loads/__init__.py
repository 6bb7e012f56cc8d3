"""What acts on the nodes beside the belt's own stiffness; every load returns forces, which run/step.py adds."""
