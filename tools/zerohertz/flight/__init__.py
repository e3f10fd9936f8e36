"""Flight recorder: what a drive was given, recorded, and run again."""
