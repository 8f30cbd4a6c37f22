"""Random walks: their weights, and what is computed of them exactly."""
