"""Signed images, and sending them to a boot loader: tools/docs/update.md."""
