"""The host's side of the link to a drive: firmware/service/README.md."""
