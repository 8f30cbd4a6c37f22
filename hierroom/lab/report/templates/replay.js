/* The replay of episodes. */
(function () {
  if (!DATA.replays.length) return;
  let episode, frames, seenAt, step = 0, timer = null;

  function framesOf(played) {
    const found = [decode(played.tiles)];
    for (const changes of played.changes) {
      const next = changes.length ? found.at(-1).slice() : found.at(-1);
      for (const [cell, tile] of changes) next[cell] = tile;
      found.push(next);
    }
    return found;
  }

  /** For each cell of the 7 by 7 view of a step where it is in the level: [view index, row, col]. */
  function* viewed(played, at) {
    const [ahead, right] = [STEP[played.directions[at]], STEP[(played.directions[at] + 1) % 4]];
    const view = decode(played.views[at]);
    for (let i = 0; i < 7; i++) for (let j = 0; j < 7; j++) {
      if (view[i * 7 + j] === T.unseen) continue;
      const row = played.rows[at] + (6 - j) * ahead[0] + (i - 3) * right[0];
      const col = played.cols[at] + (6 - j) * ahead[1] + (i - 3) * right[1];
      if (row >= 0 && col >= 0 && row < played.size && col < played.size) yield [row, col];
    }
  }

  function choose(played) {
    pause();
    episode = played;
    frames = framesOf(played);
    seenAt = new Int32Array(played.size * played.size).fill(1 << 30);
    for (let at = played.views.length - 1; at >= 0; at--) for (const [row, col] of viewed(played, at)) seenAt[row * played.size + col] = at;
    step = 0;
    byId("scrub").max = length();
    byId("replay-said").textContent = played.title;
    byId("subgoals").replaceChildren(...played.subgoals.map(subgoalButton));
    byId("meta-panel").hidden = !played.meta;
    drawTimeline();
    show();
  }

  const length = () => episode.actions.length;
  const goalNow = () => episode.goals[Math.min(step, length() - 1)];
  const numbers = () => Object.fromEntries(episode.colours.map((colour, index) => [colour, index + 1]));
  const paintOf = (name) => RGB[name.split(" ")[0]] || (name === "exit" ? RGB.green : colourOf("faint"));

  function subgoalButton(subgoal) {
    const mark = subgoal.outcome === "reached" ? "✓ reached" : subgoal.outcome;
    const button = element("button", { type: "button" }, element("span", {}, String(subgoal.first_step)),
      element("span", {}, swatch(subgoal.name), subgoal.name), element("span", { class: subgoal.outcome === "reached" ? "" : "no" }, `${mark}, ${subgoal.steps}`));
    button.addEventListener("click", () => go(subgoal.first_step - 1));
    return element("li", {}, button);
  }

  function swatch(name) {
    const made = element("span", { class: "swatch" });
    made.style.background = paintOf(name);
    return made;
  }

  const current = () => episode.subgoals.findLastIndex((subgoal) => subgoal.first_step - 1 <= Math.min(step, length() - 1));

  function drawLevel() {
    const { size } = episode;
    const [pen, side] = prepared(byId("level"), size);
    const tiles = frames[step], room = numbers(), fog = byId("fog").checked, wanted = tilesOf(goalNow());
    for (let cell = 0; cell < size * size; cell++) {
      const isHidden = fog && seenAt[cell] > step;
      drawTile(pen, isHidden ? T.unseen : tiles[cell], cell % size * side, Math.floor(cell / size) * side, side, room);
    }
    pen.fillStyle = "rgba(255, 255, 255, .2)";
    for (const [row, col] of viewed(episode, step)) pen.fillRect(col * side, row * side, side, side);
    pen.strokeStyle = "rgba(255, 160, 150, .55)";
    pen.lineWidth = Math.max(1, side * .08);
    pen.beginPath();
    for (let at = Math.max(0, step - 25); at <= step; at++) pen.lineTo((episode.cols[at] + .5) * side, (episode.rows[at] + .5) * side);
    pen.stroke();
    tiles.forEach((tile, cell) => {
      if (wanted.includes(tile) && !(fog && seenAt[cell] > step)) frame(pen, cell % size * side, Math.floor(cell / size) * side, side);
    });
    drawAgent(pen, episode.cols[step] * side, episode.rows[step] * side, side, episode.directions[step]);
  }

  function drawView() {
    const [pen, side] = prepared(byId("view"), 7);
    const view = decode(episode.views[step]), room = numbers(), wanted = tilesOf(goalNow());
    for (let i = 0; i < 7; i++) for (let j = 0; j < 7; j++) {
      const tile = view[i * 7 + j];
      drawTile(pen, tile, i * side, j * side, side, room);
      if (wanted.includes(tile)) frame(pen, i * side, j * side, side);
    }
    drawAgent(pen, 3 * side, 6 * side, side, 3);
  }

  function bars(target, rows, kind) {
    target.replaceChildren(...rows.map(([name, share, isTaken]) => {
      const inner = element("div");
      inner.style.width = `${100 * share}%`;
      return element("div", { class: `bar ${kind}${isTaken ? " taken" : ""}` }, element("span", {}, name), element("div", {}, inner), element("span", {}, `${(100 * share).toFixed(1)}%`));
    }));
  }

  function showDecisions() {
    const { controller, meta } = episode;
    if (step === length() || !controller) {
      byId("actions").textContent = controller ? (episode.success ? "The agent has escaped." : "The episode was cut off.") : "This agent computes no probabilities.";
    } else {
      bars(byId("actions"), controller.probabilities[step].map((share, action) => [T.actions[action], share, action === episode.actions[step]]), "");
    }
    if (!meta) return;
    const turn = meta.steps.findLastIndex((at) => at <= step);
    const goal = episode.goals[meta.steps[turn]];
    const shares = meta.probabilities[turn].map((share, id) => [id === 13 ? "no goal" : episode.names[id] || "", share, id === goal || id === 13 && goal < 0]);
    bars(byId("meta-actions"), shares.filter(([name, share]) => name && share > .0005).sort((a, b) => b[1] - a[1]).slice(0, 6), "goal");
  }

  function drawValue() {
    const values = episode.controller ? episode.controller.values : [];
    const svg = byId("value"), n = Math.max(1, length() - 1);
    if (!values.length) { byId("value-said").textContent = "none"; svg.replaceChildren(); return; }
    const [low, high] = [Math.min(0, ...values), Math.max(.01, ...values)];
    const y = (value) => 96 - 90 * (value - low) / (high - low);
    svg.setAttribute("viewBox", `0 0 ${n} 100`);
    const line = { fill: "none", "vector-effect": "non-scaling-stroke" };
    const rewards = episode.rewards.map((reward, at) => reward > 0 ? `M ${at} 100 V 88` : "").join("");
    svg.replaceChildren(
      shape("path", { ...line, d: `M 0 ${y(0)} H ${n}`, stroke: colourOf("line"), "stroke-width": 1 }),
      shape("path", { ...line, d: rewards || "M 0 0", stroke: colourOf("good"), "stroke-width": 3 }),
      shape("path", { ...line, d: "M" + values.map((value, at) => `${at} ${y(value).toFixed(2)}`).join("L"), stroke: colourOf("accent"), "stroke-width": 2 }),
      shape("path", { ...line, d: `M ${Math.min(step, n)} 0 V 100`, stroke: colourOf("ink"), "stroke-width": 1.5, class: "cursor" }));
    byId("value-said").textContent = step < values.length ? `${values[step].toFixed(3)} of ${high.toFixed(3)} at most` : "the episode has ended";
  }

  function drawTimeline() {
    const svg = byId("timeline");
    svg.setAttribute("viewBox", `0 0 ${length()} 10`);
    svg.replaceChildren(...episode.subgoals.map((subgoal) => {
      const made = shape("rect", { x: subgoal.first_step - 1, y: subgoal.outcome === "reached" ? 1 : 5, width: subgoal.steps, height: subgoal.outcome === "reached" ? 8 : 4, fill: paintOf(subgoal.name), stroke: colourOf("paper"), "stroke-width": 1, "vector-effect": "non-scaling-stroke" });
      made.append(shape("title", {}, `${subgoal.name}: ${subgoal.outcome}, ${subgoal.steps} steps`));
      return made;
    }));
  }

  function show() {
    const held = episode.colours.map((_, index) => index + 1).filter((room) => episode.keys[step] >> (room - 1) & 1);
    const colour = (room) => T.colours[episode.colours[room - 1]];
    const achieved = step ? episode.achieved[step - 1] : -1;
    const goal = episode.names[goalNow()];
    const rows = [
      ["step", `${step} of ${length()} (limit ${episode.limit})`],
      ["last action", step ? T.actions[episode.actions[step - 1]] || "illegal action" : "none"],
      ["subgoal", goal],
      ["keys held", held.map((room) => `${colour(room)} key ${room}`).join(", ") || "none"],
      ["achieved", achieved >= 0 ? episode.names[achieved] : "nothing in this step"],
    ];
    byId("now").replaceChildren(...rows.flatMap(([name, text]) => [element("dt", {}, name),
      element("dd", { id: `now-${name.replace(" ", "-")}` }, ...(name === "subgoal" && goalNow() >= 0 ? [swatch(goal)] : []), text)]));
    byId("scrub").value = step;
    byId("scrub").setAttribute("aria-valuetext", `step ${step} of ${length()}, subgoal ${goal}`);
    const at = current();
    [...byId("subgoals").children].forEach((item, index) => {
      item.firstChild.setAttribute("aria-current", String(index === at));
      if (index === at) byId("subgoals").scrollTop = Math.max(0, item.offsetTop - byId("subgoals").offsetTop - 60);
    });
    drawLevel();
    drawView();
    drawGraph(byId("graph"), episode, step, goalNow());
    showDecisions();
    drawValue();
  }

  function go(to) {
    step = Math.max(0, Math.min(length(), to));
    show();
  }

  function pause() {
    clearTimeout(timer);
    timer = null;
    byId("play").textContent = "Play";
  }

  function play() {
    if (step === length()) step = 0;
    byId("play").textContent = "Pause";
    (function next() {
      timer = setTimeout(() => {
        go(step + 1);
        if (step === length()) pause(); else next();
      }, 1000 / Number(byId("speed").value));
    })();
  }

  const toggle = () => timer === null ? play() : pause();
  const stepBy = (by) => { pause(); go(step + by); };
  const actions = { first: () => { pause(); go(0); }, back: () => stepBy(-1), play: toggle, forward: () => stepBy(1), last: () => { pause(); go(length()); } };
  for (const [id, act] of Object.entries(actions)) byId(id).addEventListener("click", act);
  byId("scrub").addEventListener("input", () => { pause(); go(Number(byId("scrub").value)); });
  byId("fog").addEventListener("change", drawLevel);
  for (const id of ["timeline", "value"]) byId(id).addEventListener("click", (event) => {
    const box = byId(id).getBoundingClientRect();
    pause();
    go(Math.round((event.clientX - box.left) / box.width * length()));
  });
  const keys = { " ": actions.play, ArrowLeft: actions.back, ArrowRight: actions.forward, Home: actions.first, End: actions.last,
    f: () => { byId("fog").checked = !byId("fog").checked; drawLevel(); } };
  document.addEventListener("keydown", (event) => {
    const target = event.target;
    if (event.ctrlKey || event.metaKey || event.altKey || target.closest("select, summary, a, .chart")) return;
    if (target.closest("button") && event.key === " ") return;
    if (target.matches("input") && event.key !== "f" && !(target.id === "scrub" && event.key === " ")) return;
    const isHere = target === document.body || byId("replay").contains(target);
    if (!isHere || !keys[event.key]) return;
    const box = byId("replay").getBoundingClientRect();
    if (target === document.body && (box.bottom < 0 || box.top > innerHeight)) return;
    event.preventDefault();
    keys[event.key]();
  });
  byId("replay-run").addEventListener("change", chooseRun);
  byId("replay-episode").addEventListener("change", () => choose(DATA.replays[byId("replay-run").value].episodes[byId("replay-episode").value]));
  function chooseRun() {
    const { episodes } = DATA.replays[byId("replay-run").value];
    fill(byId("replay-episode"), episodes.map((played, index) => [index, `${index + 1}: graph ${played.graph.name}, ${played.success ? "escaped" : "did not escape"}, ${played.actions.length} steps`]));
    choose(episodes[0]);
  }
  fill(byId("replay-run"), DATA.replays.map((replay, index) => [index, replay.run]));
  chooseRun();
  onTheme.push(() => { drawTimeline(); show(); });
  addEventListener("resize", () => { drawLevel(); drawView(); });
})();
