"""The network protocol of the learner, and the recurrent actor-critic that ships with hierroom."""
