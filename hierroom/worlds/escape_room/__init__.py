"""The EscapeRoom world: levels, their dynamics, the agent's observations, rendering, and shortest solutions."""
