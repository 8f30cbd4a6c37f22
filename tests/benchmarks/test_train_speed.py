"""The benchmark of training times each part of the trainer."""

import pytest

pytest.importorskip("sb3_contrib")
from benchmarks import train_speed


def test_each_part_of_training_takes_time():
    trainer, seconds = train_speed.ours("a", 1, method="ppo", features=("view",))
    trainer.advance()
    assert set(seconds) == {"world", "features", "policy", "update"}
    assert all(spent > 0 for spent in seconds.values())
    assert seconds.total() < trainer.seconds + trainer.compile_seconds
