"""Compilation of kernels by Numba: the decorator, where compiled kernels are kept, a clock, and compiling ahead."""
