"""Demo and report: the paper's thirteen experiments in pictures, beside what the paper shows."""
