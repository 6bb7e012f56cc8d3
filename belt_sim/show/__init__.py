"""What people see of a result: pictures, the report, the terminal, recordings for Rerun, progress."""
