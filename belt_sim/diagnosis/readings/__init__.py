"""What was read, and what the model says would be read, as arrays of one shape."""
