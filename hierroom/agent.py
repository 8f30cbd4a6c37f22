"""A trained agent, ready to act: the meta-controller and the controller of a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hierroom.assembly import make_inputs, make_learner
from hierroom.errors import InputError
from hierroom.learners import Policy
from hierroom.meta import MetaController, at_play, make_meta
from hierroom.presets import TrainConfig
from hierroom.runs import RunFolder
from hierroom.trainer import Trainer
from hierroom.turns import Step, Turns


class Agent:
    """Acts in the rooms of a `Turns`; learns nothing.

    Args:
        config: what was trained.
        policy: the controller's policy, for as many rooms as the turns have.
        meta: who picks the goals.
        is_greedy: whether the controller takes its most probable action instead of drawing one. A policy that
            escapes whenever it draws can turn on the spot for ever when it is greedy. A learned meta-controller draws.
    """

    def __init__(self, config: TrainConfig, policy: Policy, meta: MetaController, *, is_greedy: bool = False):
        self.inputs = make_inputs(config)
        self.meta = meta
        self._act = policy.act_greedily if is_greedy else policy.act
        self._policy = policy

    @classmethod
    def of(cls, trainer: Trainer, rooms: int, *, seed: int = 0, is_greedy: bool = False) -> Agent:
        """The agent that a trainer has trained so far, for a number of rooms of their own."""
        meta = at_play(trainer.meta, rooms, seed=seed)
        return cls(trainer.config, trainer.learner.policy(rooms, seed=seed), meta, is_greedy=is_greedy)

    @classmethod
    def load(
        cls,
        run: RunFolder,
        rooms: int,
        *,
        seed: int = 0,
        is_greedy: bool = False,
        meta: str | None = None,
        steps: int | None = None,
    ) -> Agent:
        """The agent of a run, for a number of rooms; it acts on the CPU, wherever it was trained.

        Args:
            run: the run's folder.
            rooms: how many rooms it will play in.
            seed: fixes its actions.
            is_greedy: see the class.
            meta: another meta-controller than the run's, as `make_meta` takes it.
            steps: which checkpoint, by its steps; None for the newest.

        Raises:
            InputError: if the run has no such checkpoint, or it does not fit its config, or there is no such
                meta-controller.
        """
        config, state = replace(run.config(), device="cpu"), run.load_checkpoint(steps)
        learner = make_learner(config, config.rooms)
        chosen = make_meta(meta) if meta else make_meta(config.meta_name, config)
        try:
            learner.take_weights(state["learner"])
            if "meta" in state and not meta:
                chosen.load_state_dict(state["meta"])  # pyright: ignore[reportAttributeAccessIssue]
        except (RuntimeError, KeyError, ValueError) as error:
            raise InputError(f"the checkpoint of {run.path} does not fit its config.json") from error
        return cls(config, learner.policy(rooms, seed=seed), at_play(chosen, rooms, seed=seed), is_greedy=is_greedy)

    def step(self, turns: Turns) -> Step:
        """Take the turns that are due, and one primitive step in every room."""
        turns.ask(self.meta)
        codes = self.inputs.codes(turns.sight())
        masks = np.ones((len(turns), self.inputs.n_actions), bool)
        step = turns.step(self._act(np.arange(len(turns)), codes, masks))
        ended = np.flatnonzero(step.over)
        if len(ended):
            self._policy.reset(ended)
        return step
