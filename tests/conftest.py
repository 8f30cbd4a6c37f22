import os
import signal

import pytest
from hypothesis import settings

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # windows are opened, on no screen
settings.register_profile("hierroom", settings.default, deadline=None)  # how long one takes depends on the load
settings.load_profile("hierroom")
# In the background of a shell SIGINT is ignored, and commands that tests start and interrupt inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def one_thread():
    """PyTorch uses one thread: at the sizes of tests two wait for each other more than they compute."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture
def heeded_hangup():
    """Do not ignore SIGHUP, which is ignored where the tests run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)
