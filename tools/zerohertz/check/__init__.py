"""Proof of gain tables in exact arithmetic. Shares no code with gain_design, on purpose."""
