"""What a campaign can tell and what it cannot, from the linear response of the model, before or after measuring."""
