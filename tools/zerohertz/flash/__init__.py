"""Writing an image into a board: the programmer's command line."""
