"""Replay: the firmware's observer on a recorded log of a real or simulated machine."""
