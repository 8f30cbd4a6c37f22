"""What acts and learns in the place of ``meta_0`` and ``controller_0``."""
