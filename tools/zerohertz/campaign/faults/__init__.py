"""`zh campaign faults`: is there a harm that the drive does not declare?"""
