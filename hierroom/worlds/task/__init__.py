"""A user's own environment as a world: a `Task`, N environments of it, and its episodes played again."""
