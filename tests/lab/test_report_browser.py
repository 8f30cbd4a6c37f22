"""The charts and the page of a report in a browser, clicked through."""

from report_page import HOSTILE, hostile_run
from report_reader import NEEDS_BROWSER, Reader

from hierroom.commands.report import main

pytestmark = NEEDS_BROWSER


def test_charts_are_drawn_zoomed_and_toggled(reader):
    for chart in ("learning", "goal", "complexity"):
        assert reader.ask(f"document.querySelectorAll('#{chart}-chart .main-svg').length") > 0
    lines = "byId('learning-chart').data.filter((trace) => trace.name && trace.visible !== 'legendonly').length"
    reader.choose("curve-graph", "b")
    assert reader.ask(lines) == 1
    names = reader.ask("byId('learning-chart').data.map((trace) => trace.name || null)")
    assert names == [None, None, "random (2 runs)"]
    reader.click("bands")
    assert reader.ask("byId('learning-chart').data.length") == 1
    reader.click("single")
    assert reader.ask("byId('learning-chart').data.length") == 3
    reader.choose("metric", "length")
    assert reader.ask("byId('learning-chart').layout.yaxis.title.text") == "episode length (steps)"
    reader.choose("over", "log")
    assert reader.ask("byId('learning-chart').layout.xaxis.type") == "log"
    reader.choose("over", "seconds")
    assert reader.ask("byId('learning-chart').layout.xaxis.title.text") == "seconds of training"
    reader.choose("over", "steps")
    before = reader.ask("byId('learning-chart')._fullLayout.xaxis.range")
    reader.browser.execute_script("return Plotly.relayout('learning-chart', {'xaxis.range': [1000, 2000]})")
    assert reader.ask("byId('learning-chart')._fullLayout.xaxis.range") == [1000, 2000] != before
    reader.ask("byId('learning-chart').scrollIntoView()")
    toggle = reader.browser.find_element("css selector", "#learning-chart .legendtoggle")
    reader.browser.execute_script(
        "for (const kind of ['mousedown', 'mouseup'])"
        "  arguments[0].dispatchEvent(new MouseEvent(kind, {bubbles: true}))",
        toggle,
    )
    reader.wait("byId('learning-chart').data.some((trace) => trace.visible === 'legendonly')")
    for mode in ("share", "training", "mean_step"):
        reader.choose("goal-mode", mode)
        assert reader.ask("byId('goal-chart').data.length") > 0
    reader.choose("measure", "exit_depth")
    assert reader.ask("byId('complexity-chart').layout.xaxis.title.text") == "exit depth"
    depths = reader.ask("byId('complexity-chart').data.map((trace) => trace.x).flat()")
    assert sorted(depths) == [2, 2]


def test_hostile_run_is_text_in_the_browser(browser, tmp_path):
    main([str(hostile_run(tmp_path)), "--out", str(tmp_path / "report.html")])
    reader = Reader(browser, tmp_path / "report.html")
    assert reader.ask("document.querySelectorAll('img, b, #main script').length") == 0
    assert reader.ask("document.querySelector('h1').textContent") == HOSTILE
    legend = reader.ask("[...document.querySelectorAll('#complexity-chart text')].map((text) => text.textContent)")
    assert "</script><script>alert(2)</script>" in legend
    reader.assert_quiet()
