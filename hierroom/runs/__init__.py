"""A training run: its config, its trainer and its folder."""
