"""A user's own environment as a world: a `Task`, N environments of it, and replays of its episodes."""
