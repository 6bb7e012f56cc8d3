"""What stands behind each command: a resolved configuration in, files in the run folder out."""
