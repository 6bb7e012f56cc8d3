"""What the paper measured (M1 to M6), each as a criterion that a model meets or fails; one statement a file."""
