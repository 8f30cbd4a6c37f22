"""The agents that act and learn as ``meta_0`` and ``controller_0``."""
