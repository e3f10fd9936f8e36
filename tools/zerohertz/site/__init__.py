"""`zh site`: the twin and the documentation as one static folder."""
