"""`zh studio`: a page in the browser for one drive."""
