"""Comparison of training runs: learning curves, their areas, and how likely one group of runs is better than another."""
