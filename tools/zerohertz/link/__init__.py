"""The host's side of the link to a drive: firmware/host/README.md."""
