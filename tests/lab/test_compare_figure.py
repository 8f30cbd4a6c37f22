"""The figure of a comparison: its size, colours and fonts, lines that differ, and the same files each time."""

from pathlib import Path

import pytest
from evaluated_runs import line, make_run, rise, rows
from pictures import has_colour, pixels

from hierroom.lab.compare.style import COLOURS


@pytest.mark.parametrize(("graphs", "size"), [("c", 1), pytest.param("abcdefg", 8, marks=pytest.mark.slow)])
def test_compare_figure_size_colours_and_fonts(tmp_path, compare, graphs, size):
    for n, meta in enumerate(("fixed-dfs", "random")):
        for graph in graphs:
            for seed in range(2):
                curve = {graph: rise(100_000 * (seed + 1 + 3 * n))}
                make_run(tmp_path / "r" / f"{meta}{graph}{seed}", curve, meta=meta, seed=seed)
    compare(tmp_path / "r", by="meta", draws=True)
    colours = pixels(Path("compare/curves.png"))
    assert colours.shape[1] == pytest.approx(300 * (3.3 if size == 1 else 6.8), abs=2)
    for colour in COLOURS[:2]:
        assert has_colour(colours, colour).sum() > 500 * size
    assert not has_colour(colours, COLOURS[2]).any()
    document = Path("compare/curves.pdf").read_bytes()
    assert document.startswith(b"%PDF")
    assert b"/FontFile2" in document  # TrueType, embedded
    assert b"/Type3" not in document
    if size == 1:
        compare(tmp_path / "r", by="meta", out="again", draws=True)
        names = {"comparison.json", "curves.csv", "curves.pdf", "curves.png", "improvement.csv", "summary.csv"}
        assert {path.name for path in Path("compare").iterdir()} == names
        for name in names:
            assert (Path("compare") / name).read_bytes() == (Path("again") / name).read_bytes(), name


def test_many_graphs_have_one_panel(tmp_path, compare):
    names = {f"keys-{n}": line(0.5) for n in range(26)}
    for seed in range(2):
        make_run(tmp_path / "r" / str(seed), names, graph="hitting_time:8..30", seed=seed)
    compare(tmp_path / "r", draws=True)
    assert pixels(Path("compare/curves.png")).shape[1] == pytest.approx(300 * 3.3, abs=2)
    assert len(rows("compare/summary.csv")) == 27
