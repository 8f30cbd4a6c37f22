"""Many training runs as one sweep: planned, trained on every core or many machines, gathered in one table."""
