"""One learner for any agent: recurrent PPO on the agent's own turns."""
