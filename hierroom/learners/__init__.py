"""Recurrent PPO for any agent that acts in turns, and random network distillation."""
