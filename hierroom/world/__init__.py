"""The EscapeRoom world: levels, their dynamics, what the agent sees, how it is drawn, and its shortest solution."""
