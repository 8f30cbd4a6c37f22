"""Pictures of goal graphs and reach curves."""
