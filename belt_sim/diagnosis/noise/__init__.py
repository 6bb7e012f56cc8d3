"""What readings scatter by: white noise, wander, errors shared by a run, and settings that are known only so well."""
