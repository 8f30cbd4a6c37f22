"""The paper's tables and figures: its own numbers, and ours next to them."""
