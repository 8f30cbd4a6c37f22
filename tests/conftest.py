import os
import signal

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # windows are opened, on no screen
# Commands that tests start and interrupt take over what is ignored here, as it is in the background of a shell.
signal.signal(signal.SIGINT, signal.default_int_handler)
