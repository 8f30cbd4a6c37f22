"""The plan of a sweep, and the digest that identifies each run."""

import hashlib
import json

import pytest
from tiny_sweep import plan

from hierroom.commands.sweep import SweepArguments
from hierroom.lab.sweep.plan import RESULTS_VERSION, Plan, read_plan
from hierroom.lab.sweep.sweep import Shard
from hierroom.runs.config.config import TrainConfig
from hierroom.support.errors import InputError
from hierroom.support.files import to_json


def test_every_combination_is_planned_once_with_seeds_outermost():
    runs = plan("method=hippo,ppo", "gamma=0.9,0.99", graphs=("c", "rooms:2"), seeds=2).runs()
    given = [(r.config.seed, r.config.env.graph, r.config.agents.method, r.config.ppo.gamma) for r in runs]
    assert len(given) == len(set(map(str, given))) == 2 * 2 * 2 * 2
    assert [seed for seed, *_ in given] == [0] * 8 + [1] * 8
    assert runs[0].identity["graph"] == "c"
    assert runs[0].identity["gamma"] == "0.9"
    assert {run.config.threads for run in runs} == {1}
    assert len({run.name for run in runs}) == len(runs)


def test_file_and_command_line_make_a_plan(tmp_path):
    path = tmp_path / "gamma=0.9" / "sweep.toml"
    path.parent.mkdir()
    path.write_text(
        'method = ["hippo", "ppo"]\nsteps = 1000\nseeds = 3\nfeatures = [["view", "goal"]]\n'
        "meta_ppo.gamma = [0.5, 0.6]\n"
        '[[variants]]\nname = "small"\nsize = 11\n[[variants]]\nname = "wide"\npreset = "large"\nsize = 31\n'
    )
    read = SweepArguments(what=(str(path), "steps=2_000", "meta=none,oracle"), seeds=1).plan()
    runs = read.runs()
    assert len(runs) == 2 * 2 * 2 * 2
    assert {run.config.steps for run in runs} == {2000}
    assert {run.config.agents.features for run in runs} == {("view", "goal")}
    assert {run.config.meta_ppo.gamma for run in runs} == {0.5, 0.6}
    assert {(run.identity["variant"], run.config.preset, run.config.env.size) for run in runs} == {
        ("small", "default", 11),
        ("wide", "large", 31),
    }


def test_words_override_the_variants_of_the_file(tmp_path):
    path = tmp_path / "sweep.toml"
    path.write_text('[[variants]]\nname = "long"\ngamma = 0.99\nsize = 31\n[[variants]]\nname = "short"\ngamma = 0.9\n')
    runs = read_plan(path, ("gamma=0.5",)).runs()
    assert [(run.identity["variant"], run.config.ppo.gamma) for run in runs] == [("long", 0.5), ("short", 0.5)]
    with pytest.raises(InputError, match=r"two runs of the sweep are the same: .* with variant short; leave one out$"):
        read_plan(path, ("gamma=0.5", "size=11")).runs()


@pytest.mark.parametrize(
    ("values", "variants", "settings", "names"),
    [
        ({"seed": [7]}, None, {"seeds": 2}, "seed and seeds"),
        ({}, {"one": {"seed": [7]}}, {"seeds": 2}, "seed and seeds"),
        ({"graph": ["a"]}, None, {"graphs": ("b",)}, "graph and graphs"),
    ],
)
def test_singular_and_plural_entries_together_raise_input_error(values, variants, settings, names):
    with pytest.raises(InputError, match=f"{names} are both given and mean the same; leave one out"):
        Plan(values, variants=variants, **settings)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("gama=0.9",), "there is no entry 'gama'; is it gamma?"),
        (("gamma",), "a sweep takes entry=value,value,... such as method=hippo,ppo, not 'gamma'"),
        (("gamma=high",), "gamma must be a number from 0 to 1, not 'high'"),
        (("method=[]",), "method needs at least one value"),
        (("seed=0,1", "gamma=0.9,0.90"), "two runs of the sweep are the same: .* from a value that is given twice"),
        (("gamma=0.9", "gamma=0.99"), "gamma is given twice; several values to try are joined by commas, gamma="),
        (("seeds=5",), "seeds is no entry of a run; it is given as --seeds, or at the head of a file"),
        (("method=dqn",), "method must be one of ppo, ppo-bonus"),
    ],
)
def test_invalid_plan_words_raise_input_error(words, message):
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        plan(*words).runs()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("steps = ", "is not a TOML file"),
        ("stepps = 3", "there is no entry 'stepps'; is it steps?"),
        ("seeds = 'many'", "seeds must be a whole number, not 'many'"),
        ("[[variants]]\ngamma = 1.0", "needs a name"),
        ('[[variants]]\nname = "two\\nlines"', "needs a name = .* of one line"),
        ("[[variants]]\nname = 'a'\n[[variants]]\nname = 'a'", "two variants have the same name"),
        ("[[variants]]\nname = 'a'\nepisodes = 3", "variant a: episodes is no entry of a run"),
    ],
)
def test_invalid_plan_file_raises_input_error_with_path(tmp_path, text, message):
    path = tmp_path / "s.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        read_plan(path)
    assert str(path) in str(error.value)


def test_shards_cover_each_run_once():
    runs = plan("gamma=0.9,0.95,0.99", seeds=3).runs()
    parts = [Shard.parse(f"{n}/4").of(runs) for n in range(1, 5)]
    assert sorted(run.digest for part in parts for run in part) == sorted(run.digest for run in runs)
    for wrong in ("0/3", "4/3", "3", "a/b", "1/-2"):
        with pytest.raises(InputError, match="a shard is NUMBER/COUNT"):
            Shard.parse(wrong)


def test_digest_changes_only_with_deciding_entries():
    (one,), (other,) = plan("seed=0").runs(), plan("seed=0", "threads=2").runs()
    assert one.digest == other.digest, "threads decide nothing"
    changes = (("gamma=0.5",), ("steps=301",), ("evaluations=3",), ("meta_ppo.gamma=0.5",))
    digests = {plan("seed=0", *change).runs()[0].digest for change in changes} | {plan("seed=1").runs()[0].digest}
    digests |= {plan("seed=0", episodes=5).runs()[0].digest, plan("seed=0", metas=("random",)).runs()[0].digest}
    assert len({one.digest, *digests}) == len(changes) + 4


def test_digest_ignores_entries_at_their_default():
    """If this fails: an entry with another default needs another RESULTS_VERSION; for a new entry renew the text."""
    defaults = json.dumps(json.loads(to_json(TrainConfig(threads=1).to_dict())), sort_keys=True)
    assert (RESULTS_VERSION, hashlib.sha256(defaults.encode()).hexdigest()[:16]) == (1, "b24770e6d5f07d11")
    (run,) = plan("seed=0", "stagger_clocks=true").runs()
    assert run.digest == plan("seed=0").runs()[0].digest
    assert run.digest != plan("seed=0", "stagger_clocks=false").runs()[0].digest


def test_two_graphs_with_one_name_raise_input_error(tmp_path):
    for folder, rooms in (("x", [0, 1]), ("y", [0, 0])):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "g.toml").write_text(f"key_rooms = {rooms}\nexit_room = 1\n")
    words = f"graph={tmp_path}/x/g.toml,{tmp_path}/y/g.toml"
    with pytest.raises(InputError, match=r"have the same row, on two goal graphs .* called alike: g.toml; give one"):
        plan(words).runs()
