"""Where the drive holds, and whether it knows when it does not."""
