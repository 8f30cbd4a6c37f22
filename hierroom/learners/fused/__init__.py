"""The learner's arithmetic for the recurrent actor-critic as compiled kernels."""
