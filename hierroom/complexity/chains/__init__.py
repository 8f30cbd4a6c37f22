"""Random walks: their weights, and exact quantities."""
