"""The replay of a report in a browser, clicked through."""

from report_reader import NEEDS_BROWSER

pytestmark = NEEDS_BROWSER


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
