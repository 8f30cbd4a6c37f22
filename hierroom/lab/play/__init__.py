"""Play levels by hand, in a window."""
