class InputError(Exception):
    """What a user gave cannot be used; the message is one line: what was wrong, what is allowed, what was given."""


class DivergenceError(FloatingPointError):
    """Training has diverged; the message is one line: which numbers are not finite or far too large, and what to do."""
