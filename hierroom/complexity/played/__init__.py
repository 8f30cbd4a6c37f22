"""Chains measured from play."""
