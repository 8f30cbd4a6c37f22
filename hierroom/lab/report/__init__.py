"""A report on training runs as one HTML file: curves, goals, complexity against learning, and a replay of episodes."""
