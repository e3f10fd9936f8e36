"""Modes and range: what the drive does beside flux-oriented control at rated flux."""
