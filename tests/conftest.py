import os

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # windows are opened, on no screen
