"""The functions behind every front end: simulate, compare, diagnose, draw; free of the command line."""
