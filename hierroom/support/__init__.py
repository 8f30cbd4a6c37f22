"""Support for a running process: states that are checked before they are used, and threads that survive a fork."""
