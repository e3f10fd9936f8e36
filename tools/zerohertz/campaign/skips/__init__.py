"""`zh campaign skips`: one instruction of a control period is not executed."""
