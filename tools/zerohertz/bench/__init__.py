"""Bench: how fast the simulation runs and what a control period costs, measured in one call."""
