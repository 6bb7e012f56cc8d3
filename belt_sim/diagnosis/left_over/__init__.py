"""What is left when effects are in: nothing but noise, or something that no effect of the library explains."""
