"""The network protocol of the learner, and the built-in recurrent actor-critic."""
