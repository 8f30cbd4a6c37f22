"""Checkpoints: allowed contents, the digest, and that nothing in them is executed."""

import hashlib
import io
import re
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from test_run_folder import SMALL, state_after

from hierroom.runs.folder.checkpoint import CHECKPOINT_FORMAT, from_bytes, to_bytes
from hierroom.runs.folder.run_folder import RunFolder
from hierroom.runs.trainer import Trainer
from hierroom.support.errors import InputError

CONTENT = to_bytes(state_after(1, weights=torch.arange(300.0), name="mine"))
STATE = {"format": CHECKPOINT_FORMAT, **state_after(1)}


def signed(content):
    return content + b"\nsha256 " + hashlib.sha256(content).hexdigest().encode() + b"\n"


def saved(value):
    buffer = io.BytesIO()
    torch.save(value, buffer)
    return signed(buffer.getvalue())


def test_checkpoint_is_read_back_unchanged():
    state = from_bytes(CONTENT)
    assert torch.equal(state["agents"]["meta_0"]["weights"], torch.arange(300.0))
    assert to_bytes({name: entry for name, entry in state.items() if name != "format"}) == CONTENT


@given(st.data())
def test_damaged_checkpoint_raises_input_error(data):
    damaged = bytearray(CONTENT)
    place = data.draw(st.integers(0, len(CONTENT) - 1))
    match data.draw(st.sampled_from(("bit", "block", "end", "more"))):
        case "bit":
            damaged[place] ^= 1 << data.draw(st.integers(0, 7))
        case "block":
            damaged[place : place + 64] = bytes(len(damaged[place : place + 64]))
        case "end":
            del damaged[place:]
        case "more":
            damaged += bytes(place % 9 + 1)
    if damaged != CONTENT:
        with pytest.raises(InputError, match=r"^(is damaged|has no digest at its end)"):
            from_bytes(bytes(damaged))


def test_load_checkpoint_error_names_the_file(tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    path = folder.save_checkpoint(state_after(1))
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        folder.load_checkpoint()
    assert re.fullmatch(f"the checkpoint {path} is damaged: its content is not the one .* made of", str(caught.value))
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match=f"^cannot read the checkpoint {path}: "):
        folder.load_checkpoint()


def test_nothing_in_a_checkpoint_is_executed(tmp_path):
    class Evil:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "evil",))

    with pytest.raises(InputError, match=r"^cannot be read: ") as caught:
        from_bytes(saved({"format": CHECKPOINT_FORMAT, "evil": Evil()}))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "evil").exists()


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ({"format": 99}, f"has format 99, this hierroom reads {CHECKPOINT_FORMAT}"),
        ([1, 2], f"has format None, this hierroom reads {CHECKPOINT_FORMAT}"),
        ({"format": True}, f"has format True, this hierroom reads {CHECKPOINT_FORMAT}"),
        ({"format": CHECKPOINT_FORMAT}, "cannot be used: Object missing required field `config`"),
        ({**STATE, "steps": -1}, "cannot be used: Expected `int` >= 0 - at `$.steps`"),
        ({**STATE, "agents": [1]}, "cannot be used: Expected `object`, got `array` - at `$.agents`"),
        ({**STATE, "seconds": float("nan")}, "cannot be used: Expected `float` >= 0.0 - at `$.seconds`"),
    ],
)
def test_invalid_content_with_valid_digest_raises_input_error(value, said):
    with pytest.raises(InputError) as caught:
        from_bytes(saved(value))
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)


def test_checkpoint_stores_numpy_values_as_plain_types():
    mine = {
        **{
            "rate": np.float64(0.5),
            "long": np.longdouble(0.25),
            "n": [np.int32(3)],
            "name": np.str_("x"),
            "is": np.True_,
        },
        **{"counts": np.arange(3.0), "big-endian": np.arange(3, dtype=">i4"), "backwards": np.arange(4)[::-2]},
        np.int64(4): (True, None),
        (np.int8(1), "a"): np.uint64(2**63),
    }
    read = from_bytes(to_bytes(state_after(1, **{"mine": mine})))["agents"]["meta_0"]["mine"]
    assert torch.equal(read.pop("counts"), torch.arange(3.0).double())
    assert torch.equal(read.pop("big-endian"), torch.arange(3, dtype=torch.int32))
    assert torch.equal(read.pop("backwards"), torch.tensor([3, 1]))
    plain = {"rate": 0.5, "long": 0.25, "n": [3], "name": "x", "is": True, 4: (True, None), (1, "a"): 2**63}
    assert read == plain
    assert [type(value) for value in read.values()] == [type(value) for value in plain.values()]


HOLDS_ITSELF: list = []
HOLDS_ITSELF.append(HOLDS_ITSELF)


@pytest.mark.parametrize(
    "wrong",
    [
        *(object(), {1, 2}, np.array(["a"]), {"deep": [object()]}, {None: 1}, {(1, object()): 2}, HOLDS_ITSELF),
        *(np.zeros(2, "i4,f8"), np.zeros(2, np.longdouble), torch.zeros(2).to_sparse(), range(3), 1j),
    ],
    ids=[
        *("object", "set", "array of texts", "nested object", "key None", "object in a key", "list in itself"),
        *("structured array", "array of longdouble", "sparse tensor", "range", "complex number"),
    ],
)
def test_saving_unreadable_values_raises_input_error(wrong, tmp_path):
    folder = RunFolder.create(tmp_path / "run", SMALL)
    with pytest.raises(InputError, match=r"^a checkpoint cannot hold mine[\w.\[\]]*(, which is |\.\.\.: )") as caught:
        folder.save_checkpoint({"steps": 1, "mine": wrong})
    assert "\n" not in str(caught.value)
    assert not list(folder.checkpoints.iterdir())


def test_equal_trainers_write_equal_checkpoint_bytes():
    first, second = (Trainer(SMALL.changed(num_envs=4)).state_dict() for _ in range(2))
    assert to_bytes(first) == to_bytes(second)
