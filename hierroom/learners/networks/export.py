"""Write a network to a file for other programs, by `torch.export` or as ONNX."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from copy import deepcopy
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch

from hierroom.learners.networks.actor_critic import AgentSpace, OneTurn
from hierroom.learners.networks.initial_weights import plain_torch
from hierroom.support.errors import InputError
from hierroom.support.files import write_atomically
from hierroom.support.output import said_when_slow

FORMATS = (".pt2", ".onnx")
_NAMES = {"input_names": ("features", "state"), "output_names": ("logits", "values", "new_state")}


def export(network: OneTurn, space: AgentSpace, path: Path) -> None:
    """Write a network for any number N of environments: see `TrainedAgent.export`."""
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise InputError(f"a network is exported to {' or '.join(FORMATS)}, not to {path.name or path}")
    if kind == ".onnx" and find_spec("onnxscript") is None:
        raise InputError("to export to .onnx install onnxscript (pip install onnxscript)")
    written, n = io.BytesIO(), torch.export.Dim("n", min=1)
    try:
        with said_when_slow(f"exporting to {path.name}"), _quiet(), torch.device("cpu"), plain_torch(), torch.no_grad():
            copied: Any = deepcopy(network).cpu().eval()
            inputs = torch.zeros(2, space.n_features, dtype=torch.uint8), copied.initial_state(2)
            program = torch.export.export(copied, inputs, dynamic_shapes=({0: n}, {0: n}))
            if kind == ".pt2":
                torch.export.save(program, written)
            else:
                exported = torch.onnx.export(program, dynamo=True, verbose=False, **_NAMES)
                assert exported is not None  # None only if it writes the file itself
                written.write(exported.model_proto.SerializeToString())
    except Exception as error:
        cause: BaseException = error
        while cause.__cause__ is not None:
            cause = cause.__cause__
        why = f"{type(cause).__name__}: {str(cause).strip().partition(chr(10))[0]}"
        limits = "it may use PyTorch's functions only, and no if or loop that depends on the values of a tensor"
        raise InputError(f"the network cannot be exported to {kind}: {why}; {limits}") from error
    write_atomically(path, written.getvalue())


@contextmanager
def _quiet() -> Iterator[None]:
    """Hide what torch prints, logs and warns of: graphs of the network, and packages that it does not need."""
    before, nowhere = logging.root.manager.disable, io.StringIO()
    with warnings.catch_warnings(), redirect_stdout(nowhere), redirect_stderr(nowhere):
        warnings.simplefilter("ignore")
        logging.disable()
        try:
            yield
        finally:
            logging.disable(before)
