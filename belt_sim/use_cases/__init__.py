"""What people do with belts: simulate, compare, diagnose, draw; free of the command line."""
