"""A run's name shows its method, graph and differences from the preset, and is a valid folder on any system."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hierroom
from hierroom.goals import GoalGraph
from hierroom.runs.config.config import META_PPO, TrainConfig
from hierroom.runs.config.presets import PRESETS
from hierroom.runs.config.run_name import MAX_LENGTH, run_name
from hierroom.train import parse

FEATURES = TrainConfig().agents.features


def named(arguments: str) -> str:
    return run_name(parse(arguments.split()).config)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ("--meta learned --task workshop:4 --preset learned", "hippo-learned-workshop-4-seed0-learned"),
        ("--preset paper --gamma 0.9", "hippo-fixed-dfs-c-seed0-paper"),  # it does not differ
        ("--drop-key --no-normalize-advantages", "hippo-fixed-dfs-c-seed0-drop_key-no-normalize_advantages"),
        ("--goal-mask existing --subgoal-horizon 50", "hippo-fixed-dfs-c-seed0-subgoal_horizon50-goal_mask-existing"),
        ("--meta-ppo.gamma 0.99", "hippo-fixed-dfs-c-seed0-meta_ppo.gamma0.99"),
        ("--meta mine.own:Nearest --network nets:Gated", "hippo-Nearest-c-seed0-network-Gated"),
        ("--warm-start runs/before", "hippo-fixed-dfs-c-seed0-warm_start-before"),
        ("--graph graphs/mine.toml", "hippo-fixed-dfs-mine-seed0"),
        ("--method ppo --graph expected_steps:100.25..140", "ppo-expected_steps-100.-c56d-seed0"),
        ("--threads 7 --device cuda:1", "hippo-fixed-dfs-c-seed0"),
        (f"--features {' '.join(FEATURES[:-1])}", "hippo-fixed-dfs-c-seed0-features-without-frontier-places"),
        (f"--features {' '.join(FEATURES)} symbol", "hippo-fixed-dfs-c-seed0-features-with-symbol"),
        ("--features view goal", "hippo-fixed-dfs-c-seed0-features-view-goal"),
        ("--task workshop:8:3:deep --seed 2", "hippo-fixed-dfs-workshop-8-3-deep-seed2"),
        ("--task workshop:4 --features symbol shelf", "hippo-fixed-dfs-workshop-4-seed0-features-symbol-shelf"),
        ("--task examples.tasks.minigrid_levels:unlock_pickup", "hippo-fixed-dfs-unlock_pickup-353d-seed0"),
    ],
)
def test_run_name_shows_differences_from_the_preset(arguments, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "graphs").mkdir()
    hierroom.GoalGraph((0, 1), 2).to_toml(tmp_path / "graphs" / "mine.toml")
    assert named(arguments) == name


def test_run_name_shortens_many_differences_to_a_digest():
    many = "--size 11 --max-steps 60 --sequence-length 16 --minibatches 2 --epochs 2 --hidden-size 32 --num-envs 8"
    name = named(many)
    assert re.fullmatch(r"hippo-fixed-dfs-c-seed0-size11-max_steps60-[\w-]*-and2-[0-9a-f]{6}", name)
    assert name == named(many)
    assert name != named(f"{many} --steps 4096")
    assert name[:-6] == named(many[:-1] + "9")[:-6]
    assert name != named(many[:-1] + "9")  # only the digest differs


TEXTS = st.text(min_size=1, max_size=300)
CHANGES = st.fixed_dictionaries(
    {"seed": st.integers(0, 2**62)},
    optional={
        "preset": st.sampled_from([*PRESETS]),
        "method": st.sampled_from(["hippo", "ppo-novelty"]),
        "meta": TEXTS,
        "graph": st.lists(
            st.sampled_from(["a", "g", "rooms:7", "hitting_time:1.5..90"])
            | TEXTS.filter(lambda text: text.isprintable() and text.strip() and text not in "abcdefg").map(
                lambda text: GoalGraph((0,) * 6, 3, label=text)
            ),
            min_size=1,
        ),
        "exclude": st.lists(st.sampled_from(["a", "rooms:3"]), max_size=9),
        "network": TEXTS,
        "warm_start": TEXTS,
        "steps": st.integers(1, 10**12),
        "gamma": st.floats(0, 1),
        "learning_rate": st.floats(1e-300, 1e300),
        "drop_key": st.booleans(),
        "num_envs": st.integers(1, 10**6),
        "hidden_size": st.integers(1, 2**16),
        "meta_ppo": st.floats(0, 1).map(lambda gamma: replace(META_PPO, gamma=gamma)),
        "features": st.lists(st.sampled_from(FEATURES), min_size=1, unique=True).map(tuple),
        "threads": st.integers(1, 64),
        "device": st.sampled_from(["cpu", "cuda"]),
    },
)


@given(CHANGES)
def test_run_name_is_a_valid_folder_name(changes):
    config = PRESETS[changes.get("preset", "default")].changed(**changes)
    name = run_name(config)
    assert 0 < len(name) <= MAX_LENGTH
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*[A-Za-z0-9_-]", name), name
    assert run_name(config.changed(threads=3, device="cuda:5")) == name
    assert Path(name).name == name


def test_run_names_in_docs_are_correct():
    page = (Path(__file__).parents[2] / "docs" / "runs.md").read_text()
    shown = [line.split()[0] for line in page.split("```text\n")[1].split("```")[0].splitlines()]
    arguments = ("", "--method ppo --graph g --seed 3 --steps 10_000_000", "--preset long --graph f", "--meta learned")
    own = "--meta own_meta_controller:NearestKeyFirst --gamma 0.9 --num-envs 8"
    assert shown == [named(one) for one in (*arguments, own)]
