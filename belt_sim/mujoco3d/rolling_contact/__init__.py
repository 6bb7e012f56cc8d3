"""The belt carried by MuJoCo's contacts alone: a scene that runs in plain MuJoCo, and its runs."""
