"""Write what README, `docs/environments.md` and `docs/concepts.md` show of the package: the table of ids, and pictures.

``python docs/scripts/environments.py`` from the root of the repository;
`tests/docs/test_docs_environments.py` compares.
"""

from __future__ import annotations

import io
import os
import re
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image

import hierroom
from hierroom.complexity import analyze
from hierroom.goals import NAMED_GRAPHS
from hierroom.support.files import write_atomically
from hierroom.worlds.escape_room.render import draw_level
from hierroom.worlds.make import make_world

DOCS = Path(__file__).parents[1]
PICTURES = DOCS / "pictures"
TILE_SIZE, N_COLOURS, SEED, WORKSHOP_STEPS = 12, 32, 0, 10
BADGE = """<svg xmlns="http://www.w3.org/2000/svg" width="134" height="20" font-family="sans-serif" font-size="11">
<rect width="134" height="20" rx="3" fill="#555"/>
<path d="M76 0h55a3 3 0 0 1 3 3v14a3 3 0 0 1-3 3H76z" fill="#007ec6"/>
<g fill="#fff" text-anchor="middle"><text x="38" y="14">PettingZoo</text><text x="105" y="14">v{version}</text></g>
</svg>
"""
MARKS = ("<!-- table: python docs/scripts/environments.py -->\n", "<!-- end of table -->")


def table() -> str:
    """Return the ids of the paper's graphs with the measures of each, and below them a picture of a level of each."""
    lines = [
        "| id | keys 1, 2, ... are in rooms | exit in room | exit depth | width | hitting time | expected steps |",
        "|---|---|---|---|---|---|---|",
    ]
    for letter in NAMED_GRAPHS:
        report = analyze(letter)
        lines.append(
            f"| `hierroom/EscapeRoom-{letter}-v0` | {', '.join(map(str, report.graph.key_rooms))} | "
            f"{report.graph.exit_room} | {report.exit_depth} | "
            f"{report.width} | {report.hitting_time:.2f} | {report.expected_steps:.1f} |"
        )
    pictures = (f"![A level of graph {letter}](pictures/level-{letter}.png)" for letter in NAMED_GRAPHS)
    lines += ["", f"| {' | '.join(NAMED_GRAPHS)} |", "|" + "---|" * len(NAMED_GRAPHS), f"| {' | '.join(pictures)} |"]
    return "\n".join(lines) + "\n"


def level(letter: str) -> NDArray[np.uint8]:
    """[H, W, 3] uint8, the first level of seed 0 of a graph."""
    env = hierroom.raw_env(graph=letter)
    env.reset(seed=SEED)
    return draw_level(env.single.turns.world.state, tile_size=TILE_SIZE)


def workshop() -> NDArray[np.uint8]:
    """[H, W, 3] uint8, a workshop with two things on its bench and a goal."""
    world = make_world(hierroom.EnvConfig(task="workshop:6"), 1, seed=SEED)
    for action in world.shortest_actions(0)[:WORKSHOP_STEPS]:
        world.step(np.array([action]))
    (goal,) = world.observe(world.everywhere).oracle_goals
    state = world.get_state()
    return world.replayer.picture(state, int(goal), world.replayer.tile_size(state), "")


def badge() -> bytes:
    """Return the SVG that says with which version of PettingZoo the tests run."""
    (version,) = re.findall(r"^pettingzoo==(\S+)", (DOCS.parent / "constraints.txt").read_text(), re.MULTILINE)
    return BADGE.format(version=version).encode()


def as_png(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture as a PNG of few colours."""
    stream = io.BytesIO()
    Image.fromarray(picture).quantize(N_COLOURS, dither=Image.Dither.NONE).save(stream, "PNG", optimize=True)
    return stream.getvalue()


def main() -> None:
    """Write the table and all pictures."""
    PICTURES.mkdir(exist_ok=True)
    for letter in NAMED_GRAPHS:
        write_atomically(PICTURES / f"level-{letter}.png", as_png(level(letter)))
    write_atomically(PICTURES / "workshop.png", as_png(workshop()))
    write_atomically(PICTURES / "pettingzoo.svg", badge())
    os.environ["SOURCE_DATE_EPOCH"] = "0"  # the same file whenever it is drawn
    with matplotlib.rc_context({"svg.hashsalt": "hierroom"}):
        analyze("f").draw(PICTURES / "graph-f.svg")
    page = DOCS / "environments.md"
    before, rest = page.read_text().split(MARKS[0])
    write_atomically(page, f"{before}{MARKS[0]}{table()}{MARKS[1]}{rest.split(MARKS[1])[1]}".encode())


if __name__ == "__main__":
    main()
