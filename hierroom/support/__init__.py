"""What a running process relies on: states that are checked before they are used, and threads that survive a fork."""
