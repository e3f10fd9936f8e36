"""From an unknown motor to a running drive: nameplate, identification, tuning."""
