"""The flash image from the host: its parameters, its sizes, and the loop with the plant (PIL)."""
