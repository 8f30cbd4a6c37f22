"""Advice before training: which method, how many steps, and how sure. `advise` is the way in."""
