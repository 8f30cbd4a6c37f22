"""Playing a level oneself, in a window."""
