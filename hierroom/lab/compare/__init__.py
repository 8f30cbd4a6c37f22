"""Comparison of training runs: learning curves, areas under them, and how likely one group is better than another."""
