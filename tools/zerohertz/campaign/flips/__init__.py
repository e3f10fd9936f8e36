"""`zh campaign flips`: one bit of a drive's RAM flips."""
