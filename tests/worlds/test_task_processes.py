"""The worker processes of a task: an environment that hangs, dies, raises, or is left, in each of its methods."""

import gc
import multiprocessing
import os
import re
import signal
import time
from contextlib import suppress
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import hierroom
from hierroom.support import interrupt
from hierroom.support.errors import InputError, RunError
from hierroom.support.interrupt import STOPS, Interrupt
from hierroom.worlds.task import worker

METHODS = ("make", "reset", "step", "render", "close")
FIRST, SECOND = "worker 1 of 2 (environments 0 to 1)", "worker 2 of 2 (environment 2)"


TEST = os.getpid()


def fault(how, trigger):
    """Have a fault; return what cannot be sent to another process."""
    match how:
        case "hang":
            time.sleep(1000)
        case "interrupt and hang":
            with suppress(FileExistsError):  # only the first environment interrupts
                trigger.with_name("interrupted").touch(exist_ok=False)
                os.kill(TEST, signal.SIGINT)
            time.sleep(1000)
        case "raise":
            raise ValueError("bad luck")
        case "exit":
            os._exit(3)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "fork and be killed":
            if os.fork():
                os.kill(os.getpid(), signal.SIGKILL)
            time.sleep(20)  # with the worker's end of its pipe
            trigger.with_name("awaited").touch()
            os._exit(0)
        case "interrupt":
            raise KeyboardInterrupt
        case "ask":
            input()
    return lambda: None


class Faulty(gymnasium.Env):
    """It has a fault in one of its methods once the file ``trigger`` exists, in processes of tasks or in this one."""

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012
    action_space, observation_space = spaces.Discrete(2), spaces.Discrete(2)

    def __init__(self, how, where, trigger, render_mode=None):
        self.how, self.where, self.trigger, self.render_mode = how, where, trigger, render_mode
        self.maybe("make")

    def maybe(self, method):
        return fault(self.how, self.trigger) if self.where == method and self.trigger.exists() else 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.maybe("reset"), {}

    def step(self, action):
        return self.maybe("step"), 0.0, False, False, {}

    def render(self):
        return self.maybe("render") or np.zeros((4, 4, 3), np.uint8)

    def close(self):
        self.maybe("close")


@pytest.fixture
def use(tmp_path):
    """Return a function that uses three environments up to a method, which then has a fault."""
    trigger = tmp_path / "fault"

    def use_until(how, method, processes=2):
        make = lambda: Faulty(how, method, trigger)  # noqa: E731
        task = hierroom.Task(make, {"never": lambda env, info: False}, target="never", processes=processes)
        if method == "make":
            task.trial  # noqa: B018 - it must be over
            trigger.touch()
        world = world_of(task)
        trigger.touch()
        uses = {
            "reset": lambda: world.begin(np.arange(3)),
            "step": lambda: world.step(np.zeros(3, np.int64)),
            "render": lambda: world._envs.render(2),
            "close": world.close,
        }
        try:
            uses[method]()
        finally:
            if method != "close":
                world.close()
                world.close()

    yield use_until
    assert multiprocessing.active_children() == []


RAISED = "ValueError: bad luck (line "


@pytest.mark.parametrize("method", METHODS[:-1])
@pytest.mark.parametrize(
    ("how", "error", "said"),
    [
        ("raise", InputError, f"FAILS: {RAISED}"),
        ("exit", RunError, "WORKER of task has ended in METHOD with exit code 3"),
        ("kill", RunError, "WORKER of task has ended in METHOD by signal SIGKILL, perhaps for lack of memory"),
        ("interrupt", InputError, "KeyboardInterrupt: "),
        ("ask", InputError, "FAILS: EOFError: EOF when reading a line (line "),
    ],
)
def test_fault_in_a_worker_raises_one_line(method, how, error, said, use, capfd):
    of_worker = SECOND if method == "render" else FIRST
    fails = "the environment cannot be drawn" if method == "render" else f"{method} of task fails"
    with pytest.raises(error) as raised:
        use(how, method)
    assert said.replace("METHOD", method).replace("WORKER", of_worker).replace("FAILS", fails) in str(raised.value)
    assert of_worker in str(raised.value)
    assert "\n" not in str(raised.value)
    assert capfd.readouterr().err == ""


def test_end_of_a_worker_is_noticed_although_a_process_of_it_lives(use, tmp_path):
    with pytest.raises(RunError, match=f"^{re.escape(FIRST)} of task has ended in step by signal SIGKILL"):
        use("fork and be killed", "step")
    assert not (tmp_path / "awaited").exists()


@pytest.mark.parametrize("method", ["reset", "step"])
def test_result_that_cannot_be_sent_raises_input_error(method, use):
    with pytest.raises(InputError, match=rf"^the result of {method} cannot be sent: .*pickle.*, in worker "):
        use("unsendable", method)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("hang", f"warning: close of task did not end, so {SECOND} is killed\n"),
        ("raise", f"warning: close of task fails: {RAISED}"),
        ("exit", ""),
        ("kill", ""),
    ],
)
def test_close_of_workers_never_raises(how, said, use, capfd, monkeypatch):
    monkeypatch.setattr(worker, "ENDING_SECONDS", 0.3)
    use(how, "close")
    printed = capfd.readouterr().err
    assert (said in printed) if said else not printed


def test_close_of_a_task_without_workers_warns(use):
    with pytest.warns(UserWarning, match=re.escape(f"close of task fails: {RAISED}")):
        use("raise", "close", processes=0)


@pytest.mark.parametrize("processes", [0, 2])
@pytest.mark.parametrize("method", METHODS[:-1])
def test_ctrl_c_says_what_hangs_and_a_second_one_ends_it(method, processes, use, monkeypatch):
    monkeypatch.setattr(interrupt, "SECONDS", 0.25)
    lines = []

    def say(line):
        lines.append(line)
        os.kill(os.getpid(), signal.SIGINT)

    with Interrupt(say=say), pytest.raises(KeyboardInterrupt):
        use("interrupt and hang", method, processes)
    name = "the environment" if (method, processes) == ("render", 0) else f"{method} of task"
    where = f" in {SECOND if method == 'render' else FIRST}" if processes else ""
    assert lines == [f"waiting for {name}{where}; press Ctrl-C again to leave without saving"]


def world_of(task, n=3):
    return task.make_world(hierroom.EnvConfig(task=task), n)


class Counting(Faulty):
    """Its observation and reward are its number of steps, and its reset's seed."""

    observation_space = spaces.Box(0, 2**32, (2,), np.int64)
    open = 0

    def __init__(self):
        Counting.open += 1

    def reset(self, *, seed=None, options=None):
        self.shown = np.array([0, seed])
        return self.shown, {}

    def step(self, action):
        self.shown = self.shown + np.array([action, 0])
        return self.shown, float(action), False, False, {}

    def close(self):
        Counting.open -= 1


def counting(processes):
    return hierroom.Task(Counting, {"never": lambda env, info: False}, target="never", processes=processes)


def test_workers_answer_in_the_order_of_the_environments():
    world = world_of(counting(2), 5)
    envs, values = [4, 0, 3, 1], [40, 0, 30, 10]
    observations, totals = world._envs.reset(envs, values)
    assert np.array(observations).tolist() == [[0, value] for value in values]
    taken = world._envs.step(envs[:3], [1, 0, 1])
    assert np.array(taken.observations).tolist() == [[1, 40], [0, 0], [1, 30]]
    assert (taken.rewards.tolist(), totals.shape, taken.totals.shape) == ([1, 0, 1], (4, 1), (3, 1))
    world.close()


def test_signals_to_stop_do_not_end_workers():
    world = world_of(counting(2))
    for number in STOPS:
        for process in multiprocessing.active_children():
            os.kill(process.pid, number)
        world.begin(np.arange(3))
    world.close()


def test_interrupted_call_cannot_be_answered_later():
    world = world_of(counting(2))
    world._envs.workers[0].call("render", 0)  # and the answer is never read
    with pytest.raises(RunError, match="was interrupted in render; make the environments anew"):
        world.begin(np.arange(3))
    world.close()
    with pytest.raises(RunError, match=r"^worker 2 of 2 .* of task was closed$"):
        world._envs.reset([2], [0])


@pytest.mark.parametrize("processes", [0, 2])
def test_rollout_that_is_left_closes_its_environments(processes):
    task = counting(processes)
    task.trial  # noqa: B018 - it is over
    before = Counting.open
    next(hierroom.rollout("random", hierroom.EnvConfig(task=task, max_steps=3), 4, num_envs=4))
    assert (Counting.open, multiprocessing.active_children()) == (before, [])


def test_workers_of_a_world_that_is_left_end():
    world_of(counting(2))
    gc.collect()
    assert multiprocessing.active_children() == []


def be_killed_in_a_step(connection, trigger):
    make = lambda: Faulty("hang", "step", trigger)  # noqa: E731
    world = world_of(hierroom.Task(make, {"never": lambda env, info: False}, target="never", processes=2))
    trigger.touch()
    world._envs.workers[0].call("step", [0], [0])  # the other one is idle
    connection.send([process.pid for process in multiprocessing.active_children()])
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="processes are looked up in /proc")
def test_killed_process_leaves_no_worker_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(worker, "ENDING_SECONDS", 0.3)
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.Process(target=be_killed_in_a_step, args=(theirs, tmp_path / "fault"))
    process.start()
    pids = ours.recv()
    process.join()
    deadline = time.monotonic() + 20
    while running := [pid for pid in pids if is_running(pid)]:
        assert time.monotonic() < deadline, running
        time.sleep(0.05)


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
