"""Plan many training runs as one sweep, train them on every core or many machines, and gather them in one table."""
