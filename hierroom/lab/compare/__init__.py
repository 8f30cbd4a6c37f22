"""Comparison of training runs: learning curves, areas under them, and how likely one group of runs is the better."""
