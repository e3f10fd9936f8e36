"""`zh bringup`: the first power-up of a board, step by step."""
