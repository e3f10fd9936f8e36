"""A configuration: one folder with motor, board and application, from nameplate to image."""
