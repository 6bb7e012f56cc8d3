"""What is told: the verdict, what it cannot be told apart from, and the next run to make."""
