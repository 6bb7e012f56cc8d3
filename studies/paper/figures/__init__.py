"""One figure of the paper a file; each has NUMBER, TITLE, and ``plate(view)``, which computes it."""
