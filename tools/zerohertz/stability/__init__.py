"""Operating-point linearisation of the whole sampled loop: `zh stability`."""
