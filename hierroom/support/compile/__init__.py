"""Compilation of kernels by Numba: the decorator, the folder of compiled kernels, a clock, and two processes."""
