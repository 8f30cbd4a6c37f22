"""Compilation of kernels by Numba: the decorator, the folder of compiled kernels, and a clock."""
