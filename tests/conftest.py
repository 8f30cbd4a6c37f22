import os
import signal

import pytest

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # windows are opened, on no screen
# Commands that tests start and interrupt take over what is ignored here, as it is in the background of a shell.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def heeded_hangup():
    """SIGHUP is not ignored, as it is where the tests run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)
