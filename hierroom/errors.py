class InputError(Exception):
    """What a user gave cannot be used; the message is one line: what was wrong, what is allowed, what was given."""
