"""The report opened from disk in a browser and clicked through, with no message on the console."""

import base64
import io
import math
import os
import shutil

import evaluated_runs
import pytest
from children import TIMES_QUIET
from PIL import Image
from report_page import HOSTILE, hostile_run

import hierroom
from hierroom.commands.report import main

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (BROWSER and DRIVER), reason="there is no Chromium with its driver on this machine"),
]
FLAGS = ["--headless", "--no-sandbox", "--no-first-run"]
FLAGS += [f"--disable-{name}" for name in ("gpu", "quic", "background-networking", "component-update", "sync")]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A report on a run that has learned a little, and on two with curves only."""
    folder = tmp_path_factory.mktemp("browsed")
    named = {"graph": "a", "size": 11, "max_steps": 80, "num_envs": 16, "minibatches": 2, "steps": 4096}
    hierroom.train(**named, meta="fixed-dfs", evaluations=3, evaluation_episodes=10, out=folder / "runs" / "a0")
    for seed in (0, 1):
        curve = {"b": evaluated_runs.rise(1e5 * (1 + seed))}
        evaluated_runs.make_run(folder / "runs" / f"b{seed}", curve, meta="random", seed=seed)
    main([str(folder), "--out", str(folder / "report.html"), "--played", "20"])
    return folder / "report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('chromium')}", "--window-size=1280,1000"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(
        options=options, service=webdriver.ChromeService(DRIVER, env={**os.environ, "SE_OFFLINE": "true"})
    )
    driver.set_script_timeout(TIMES_QUIET * 6)
    yield driver
    driver.quit()


class Reader:
    """A reader of the page, who clicks, presses keys and looks."""

    def __init__(self, browser, path, width=1280, scheme="light"):
        self.browser = browser
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": width < 600},
        )
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        browser.get(path.as_uri())
        self.ask("localStorage.clear()")
        browser.refresh()
        self.wait("document.documentElement.dataset.charts === 'drawn' || !document.querySelector('.chart')")

    def ask(self, expression):
        return self.browser.execute_script(f"return {expression}")

    def wait(self, expression):
        script = (
            f"const done = arguments[0]; (function look() {{ ({expression}) ? done(true) : setTimeout(look, 20) }})()"
        )
        assert self.browser.execute_async_script(script)

    def click(self, identity):
        self.browser.find_element("id", identity).click()

    def choose(self, identity, value):
        self.ask(f"(byId('{identity}').value = '{value}', byId('{identity}').dispatchEvent(new Event('change')))")
        assert self.ask(f"byId('{identity}').value") == str(value)

    def press(self, keys, identity=None):
        element = (
            self.browser.find_element("id", identity) if identity else self.browser.find_element("tag name", "body")
        )
        element.send_keys(keys)

    @property
    def step(self):
        moment = int(self.ask("byId('now-step').textContent").split()[0])
        assert self.ask("Number(byId('scrub').value)") == moment
        return moment

    def picture(self, identity):
        data = self.ask(f"byId('{identity}').toDataURL()")
        with Image.open(io.BytesIO(base64.b64decode(data.partition(",")[2]))) as image:
            assert len(image.convert("RGB").getcolors(1 << 20)) > 3
        return data

    def text(self, identity):
        return self.ask(f"byId('{identity}').textContent")

    def assert_quiet(self):
        assert self.browser.get_log("browser") == []
        assert self.ask("performance.getEntriesByType('resource').map((one) => one.name)") == []


@pytest.fixture
def reader(browser, report):
    reader = Reader(browser, report)
    yield reader
    reader.assert_quiet()


def test_the_replay_steps_scrubs_and_plays(reader):
    last = reader.ask("DATA.replays[0].episodes[0].actions.length")
    assert reader.step == 0
    before, view = reader.picture("level"), reader.picture("view")
    reader.click("forward")
    reader.click("forward")
    assert reader.step == 2
    assert reader.picture("level") != before
    actions = reader.ask("DATA.replays[0].episodes[0].actions.map((action) => DATA.tiles.actions[action])")
    assert reader.text("now-last-action") == actions[1]
    reader.click("back")
    assert reader.step == 1
    reader.ask(f"(byId('scrub').value = {last}, byId('scrub').dispatchEvent(new Event('input')))")
    assert reader.step == last
    assert reader.picture("view") != view
    reader.click("play")  # from the end it begins again
    reader.wait("Number(byId('scrub').value) >= 1 && Number(byId('scrub').value) < 10")
    assert reader.text("play") == "Pause"
    reader.click("play")
    assert reader.text("play") == "Play"
    paused = reader.step
    reader.ask("new Promise((done) => setTimeout(done, 500))")
    assert reader.step == paused
    reader.choose("speed", 60)
    reader.click("last")
    reader.click("first")
    reader.click("play")
    reader.wait(f"Number(byId('scrub').value) === {last} && byId('play').textContent === 'Play'")  # it stops by itself


def test_keyboard_controls_the_replay(reader):
    from selenium.webdriver.common.keys import Keys

    reader.ask("byId('replay').scrollIntoView()")
    last = reader.ask("DATA.replays[0].episodes[0].actions.length")
    reader.press(Keys.ARROW_RIGHT * 3 + Keys.ARROW_LEFT)
    assert reader.step == 2
    reader.press(Keys.END)
    assert reader.step == last
    reader.press(Keys.HOME)
    assert reader.step == 0
    reader.press(" ")
    reader.wait("byId('play').textContent === 'Pause' && Number(byId('scrub').value) > 0")
    reader.press(" ")
    assert reader.text("play") == "Play"
    reader.press(Keys.HOME)
    before = reader.picture("level")
    reader.press("f")
    assert reader.ask("byId('fog').checked")
    assert reader.picture("level") != before
    reader.press("f")
    assert reader.picture("level") == before
    reader.press(Keys.ARROW_RIGHT, "scrub")  # the slider's own keys
    assert reader.step == 1
    reader.press(Keys.ARROW_RIGHT, "metric")  # a select keeps its keys
    assert reader.step == 1


def test_graph_subgoal_probabilities_and_value_follow_the_step(reader):
    episode = "DATA.replays[0].episodes[0]"
    reader.click("last")
    held = reader.ask(f"{episode}.keys.at(-1)")
    doors = reader.ask(f"{episode}.doors.at(-1)")
    key = reader.ask("document.querySelector('#graph .key').dataset.state")
    assert key == ("held" if held & 1 else "used" if doors & 1 else "not held")
    assert reader.ask("document.querySelectorAll('#graph .room').length") == 2
    assert "escaped" in reader.text("actions") or "cut off" in reader.text("actions")
    reader.click("first")
    assert reader.ask("document.querySelectorAll('#graph .wanted').length") == 1
    goal = reader.ask(f"{episode}.names[{episode}.goals[0]]")
    assert reader.text("now-subgoal") == goal
    for step in (0, 1, 2):
        shares = reader.ask(f"{episode}.controller.probabilities[{step}]")
        shown = reader.ask("[...document.querySelectorAll('#actions .bar')].map((bar) => bar.lastChild.textContent)")
        assert shown == [f"{100 * share:.1f}%" for share in shares]
        taken = reader.ask("document.querySelector('#actions .taken').firstChild.textContent")
        assert taken == reader.ask(f"DATA.tiles.actions[{episode}.actions[{step}]]")
        assert reader.text("value-said").startswith(f"{reader.ask(f'{episode}.controller.values[{step}]'):.3f} of")
        reader.click("forward")
    n = reader.ask(f"{episode}.subgoals.length")
    assert reader.ask("byId('subgoals').children.length") == n
    reader.ask(f"byId('subgoals').children[{n - 1}].firstChild.click()")
    assert reader.step == reader.ask(f"{episode}.subgoals[{n - 1}].first_step") - 1
    assert reader.ask(f"byId('subgoals').children[{n - 1}].firstChild.getAttribute('aria-current')") == "true"


def test_exit_label_covers_no_key(reader):
    reader.ask(
        "Object.assign(DATA.replays[0].episodes[0], {colours: [0, 1], graph: "
        "{name: '', key_rooms: [0, 1], exit_room: 1, places: [[0, 0], [0, 1], [0, 2]]}})"
    )
    reader.click("forward")
    box = "getBoundingClientRect()"
    label = reader.ask(f"[...byId('graph').querySelectorAll('text')].find((one) => one.textContent === 'exit').{box}")
    key = reader.ask(f"document.querySelector('#graph .key[data-room=\"2\"]').{box}")
    assert label["left"] >= key["right"] or label["bottom"] <= key["top"]


def test_choosing_an_episode_restarts_the_replay(reader):
    said = reader.text("replay-said")
    reader.click("forward")
    reader.choose("replay-episode", 1)
    assert reader.text("replay-said") != said
    assert reader.step == 0


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


def test_goal_names_are_text_in_the_chart(reader):
    name = '<a href="https://example.org">key</a> 1'
    reader.browser.execute_script("DATA.goals[0].training = {steps: [1, 2], shares: {[arguments[0]]: [0, 1]}}", name)
    reader.choose("goal-mode", "training")
    assert reader.ask("document.querySelector('#goal-chart .legend').textContent") == name
    assert reader.ask("document.querySelectorAll('#goal-chart .legend a').length") == 0


def test_many_goals_have_different_lines(reader):
    reader.ask(
        "DATA.goals[0].training = {steps: [1, 2], shares: "
        "Object.fromEntries([...Array(24).keys()].map((n) => [`item ${n}`, [0, 1]]))}"
    )
    reader.choose("goal-mode", "training")
    lines = reader.ask("byId('goal-chart').data.map((trace) => trace.line.color + trace.line.dash)")
    assert len({*lines}) == 24


def test_eight_groups_differ_on_dark_pages(browser, tmp_path):
    for n in range(8):
        evaluated_runs.make_run(tmp_path / "in" / str(n), {"a": evaluated_runs.line(1 - n / 100)}, gamma=0.9 + n / 100)
    main([str(tmp_path / "in"), "--replays", "0", "--out", str(tmp_path / "report.html")])
    reader = Reader(browser, tmp_path / "report.html", scheme="dark")
    ink = reader.ask("colourOf('ink')")
    assert ink in reader.ask("byId('learning-chart').data.map((trace) => trace.line.color)")
    marks = reader.ask("byId('complexity-chart').data.map((trace) => trace.marker.color + trace.marker.symbol[0])")
    assert len({*marks}) == 8
    assert ink in {mark[:7] for mark in marks}
    marks = "byId('complexity-chart').data.map((trace) => [trace.marker.symbol[0], trace.y[0]])"
    open_marks = [height for symbol, height in reader.ask(marks) if symbol == "triangle-up-open"]
    assert len({*open_marks}) == len(open_marks) > 1
    reader.assert_quiet()


def test_single_run_on_many_graphs_has_no_bands(browser, tmp_path):
    curves = dict.fromkeys("abc", evaluated_runs.line(1.0))
    evaluated_runs.make_run(tmp_path / "run", curves, graph=("a", "b", "c"))
    main([str(tmp_path / "run"), "--replays", "0", "--out", str(tmp_path / "report.html")])
    reader = Reader(browser, tmp_path / "report.html")
    assert reader.ask("byId('learning-chart').data.some((trace) => trace.fill)") is False
    assert reader.text("learning-said").startswith("Thick lines")
    reader.choose("curve-graph", "a")
    assert reader.ask("byId('learning-chart').data.some((trace) => trace.fill)") is True
    assert "(Wilson)" in reader.text("learning-said")
    reader.assert_quiet()


def test_theme_button_switches_dark_and_light(browser, report):
    for scheme in ("light", "dark"):
        reader = Reader(browser, report, scheme=scheme)
        paper = "getComputedStyle(document.body).backgroundColor"
        ink = "byId('learning-chart').layout.font.color"
        colours = reader.ask(paper), reader.ask(ink)
        assert (colours[0] == "rgb(255, 255, 255)") == (scheme == "light")
        reader.click("theme")
        other = reader.ask(paper), reader.ask(ink)
        assert other[0] != colours[0]
        assert other[1] != colours[1]
        assert reader.ask("document.documentElement.dataset.theme") == ("dark" if scheme == "light" else "light")
        reader.browser.refresh()  # the choice is kept
        assert reader.ask(paper) == other[0]
        reader.assert_quiet()


@pytest.mark.parametrize("width", [1280, 768, 390, 320])
def test_page_fits_wide_and_narrow_screens(browser, report, width):
    reader = Reader(browser, report, width=width)
    assert reader.ask("document.documentElement.scrollWidth") <= width
    assert 0.9 * min(width, 500) * 0.85 <= reader.ask("byId('level').getBoundingClientRect().width") <= width
    for button in ("first", "back", "play", "forward", "last"):
        box = reader.ask(f"byId('{button}').getBoundingClientRect().toJSON()")
        assert box["left"] >= 0
        assert box["right"] <= width
        assert min(box["width"], box["height"]) >= 35  # large enough for a finger
    reader.assert_quiet()


def test_hostile_run_is_text_in_the_browser(browser, tmp_path):
    main([str(hostile_run(tmp_path)), "--out", str(tmp_path / "report.html")])
    reader = Reader(browser, tmp_path / "report.html")
    assert reader.ask("document.querySelectorAll('img, b, #main script').length") == 0
    assert reader.ask("document.querySelector('h1').textContent") == HOSTILE
    legend = reader.ask("[...document.querySelectorAll('#complexity-chart text')].map((text) => text.textContent)")
    assert "</script><script>alert(2)</script>" in legend
    reader.assert_quiet()


def test_zero_steps_have_a_mark_on_log_axis(browser, tmp_path):
    for name, start in (("warm", 1.0), ("cold", 0.0)):
        curve = {"a": evaluated_runs.line(1.0, start)}
        evaluated_runs.make_run(tmp_path / "in" / name, curve, gamma=0.9 + start / 20)
    main([str(tmp_path / "in"), "--replays", "0", "--out", str(tmp_path / "report.html")])
    reader = Reader(browser, tmp_path / "report.html")
    assert reader.ask("byId('complexity-chart').layout.yaxis.type") == "log"
    marks = reader.ask("byId('complexity-chart').data.map((trace) => [trace.marker.symbol[0], trace.y[0]])")
    assert sorted(marks) == [["circle", 950_000], ["triangle-down-open", 475_000]]
    low, high = reader.ask("byId('complexity-chart')._fullLayout.yaxis.range")
    assert low < math.log10(475_000) < high
    reader.assert_quiet()
