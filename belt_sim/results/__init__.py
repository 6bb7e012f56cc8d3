"""What comes out: simulations, comparisons and diagnoses as frozen dataclasses, SI inside; JSON only at the border."""
