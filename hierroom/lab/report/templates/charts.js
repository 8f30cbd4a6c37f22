/* The charts, by Plotly, which is kept compressed in this page. */
(async function () {
  const charts = [...document.querySelectorAll(".chart")];
  if (!charts.length) return;
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  try {
    const bytes = Uint8Array.from(atob(byId("plotly").textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
    byId("plotly").remove();
  } catch (error) {
    for (const chart of charts) chart.textContent = `This browser cannot unpack the charts (${error.message}); the tables hold the numbers.`;
    return;
  }

  /** Plotly reads tags in names; names are to be read as they are. */
  const plain = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
  const DASHES = ["solid", "dot", "dashdot", "longdash"], SYMBOLS = ["circle", "square", "diamond", "cross"];
  /** The colour of a group; black would not be seen on the dark page. */
  const groupPaint = (number) => DATA.groups[number].colour === "#000000" ? colourOf("ink") : DATA.groups[number].colour;
  const faded = (colour, alpha) => colour + Math.round(255 * alpha).toString(16).padStart(2, "0");
  const isNarrow = () => innerWidth < 640;
  const CONFIG = { responsive: true, displaylogo: false, modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d", "toImage"]] };

  function draw(id, traces, xaxis, yaxis, legend = true) {
    const [ink, line] = [colourOf("ink"), colourOf("line")];
    const axis = { gridcolor: line, zerolinecolor: line, linecolor: line, automargin: true };
    for (const chart of byId(id).querySelectorAll(".loading")) chart.remove();
    Plotly.react(byId(id), traces, {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: ink, size: 13, family: "system-ui, sans-serif" },
      margin: { l: 56, r: 12, t: 40, b: isNarrow() ? 70 + 16 * traces.filter((trace) => trace.showlegend !== false).length : 44 }, height: isNarrow() ? 380 + 16 * traces.filter((trace) => trace.showlegend !== false).length : 430, hovermode: "closest", showlegend: legend,
      legend: isNarrow() || traces.length > 12 ? { orientation: "h", yref: "container", yanchor: "bottom", y: 0, font: { size: 11 } } : { font: { size: 12 } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colourOf("faint"), activecolor: colourOf("accent") }, barmode: "group", uirevision: `${xaxis.type}${xaxis.title}${yaxis.title}`,
      xaxis: { ...axis, ...xaxis, title: { text: xaxis.title } }, yaxis: { ...axis, ...yaxis, title: { text: yaxis.title } },
      hoverlabel: { namelength: -1 },
    }, CONFIG);
  }

  /** Names of goals: key 1, door 1, key 2, ... exit. */
  const place = (name) => name === "exit" ? 1e9 : 2 * Number(/^(?:key|door) (\d+)$/.exec(name)?.[1] ?? 1e6) + name.startsWith("door");
  const inOrder = (items, nameOf = (item) => item) => [...new Set(items)].sort((one, other) => place(nameOf(one)) - place(nameOf(other)));

  function listen(ids, act) {
    for (const id of ids) byId(id).addEventListener("change", act);
    onTheme.push(act);
    act();
  }

  if (byId("learning-chart")) {
    fill(byId("metric"), DATA.metrics.map((metric) => [metric.name, metric.label]));
    const graphs = [...new Set([...DATA.curves.map((curve) => curve.graph), ...DATA.runs.flatMap((run) => run.graphs.map((one) => one.name))])];  // null: all together
    const shown = graphs.length > 1 && !graphs.includes(null) && !DATA.curves.length ? [null, ...graphs] : graphs;
    fill(byId("curve-graph"), shown.map((graph) => [graph ?? "", graph ?? "all together"]));
    byId("single").checked = !DATA.curves.length;
    listen(["metric", "curve-graph", "over", "bands", "single"], () => {
      const metric = DATA.metrics.find((one) => one.name === byId("metric").value);
      const graph = byId("curve-graph").value || null, over = byId("over").value, hasBands = byId("bands").checked;
      const scale = metric.is_rate ? 100 : 1, traces = [], single = [];  // single runs lie below
      const scaled = (values) => values.map((value) => value === null ? null : value * scale);
      const band = (x, lows, highs, number, key, into) => {
        if (!hasBands || !lows.some((low) => low !== null)) return;
        const shared = { x, legendgroup: key, showlegend: false, hoverinfo: "skip", mode: "lines", line: { width: 0 } };
        into.push({ ...shared, y: scaled(lows) }, { ...shared, y: scaled(highs), fill: "tonexty", fillcolor: faded(groupPaint(number), .18) });
      };
      /** What advice predicted: from its 90% interval at 50% success to that at 95%, with the medians on a line. */
      const forecast = ({ predicted, steps, group }, key) => {
        const end = Math.max(steps.at(-1), ...predicted.map(([, value]) => value ?? 0)), upTo = (x) => Math.min(x ?? end, end);
        const ends = (isHigh) => predicted.map(([percent, , low, high]) => [upTo(isHigh ? high : low), percent]);
        const thick = predicted.length === 1 ? 1.5 : 0, lows = ends(false), highs = ends(true).reverse();  // alone, it is a bar
        const outline = thick ? [...lows, ...highs, ...[...highs, ...lows].map(([x, y]) => [x, y + thick])] : [...lows, ...highs];
        const shared = { legendgroup: key, hoverinfo: "skip" };
        traces.push({ ...shared, x: outline.map(([x]) => x), y: outline.map(([, y]) => y), mode: "lines", line: { width: 0 }, fill: "toself", fillcolor: faded(groupPaint(group), .12), name: plain(`${DATA.groups[group].label}, predicted (90%)`) });
        const known = predicted.filter(([, value]) => value !== null);
        traces.push({ ...shared, x: known.map(([, value]) => value), y: known.map(([percent]) => percent), mode: "lines+markers", marker: { symbol: "x", size: 7 }, line: { color: groupPaint(group), width: 1, dash: "dot" }, showlegend: false });
      };
      let n = 0;
      for (const curve of over === "seconds" ? [] : DATA.curves.filter((one) => one.metric === metric.name && one.graph === graph)) {
        const { label, dash } = DATA.groups[curve.group], key = `group${curve.group}`;
        if (curve.predicted.length && hasBands) forecast(curve, key);
        band(curve.steps, curve.lows, curve.highs, curve.group, key, traces);
        traces.push({ x: curve.steps, y: scaled(curve.values), name: plain(`${label} (${curve.n} run${curve.n === 1 ? "" : "s"})`), legendgroup: key, mode: "lines", line: { color: groupPaint(curve.group), dash, width: 2.5 } });
        n += 1;
      }
      const partsOf = (run) => run.graphs.filter((one) => graph === null || one.name === graph);
      const isLonely = DATA.runs.length === 1, isSingle = DATA.runs.every((run) => partsOf(run).length <= 1);
      const hasWilson = metric.name === "success_rate" && isSingle && (isLonely || !n && DATA.runs.length <= 6);
      if (byId("single").checked || over === "seconds" || !n || isLonely) for (const [number, run] of DATA.runs.entries()) {
        const parts = partsOf(run);
        for (const [part, own] of parts.entries()) {
          const x = over === "seconds" ? own.seconds : own.steps, key = `run${number}.${part}`;
          if (hasWilson) band(x, own.success_low, own.success_high, run.group, key, single);
          const title = parts.length > 1 ? `${run.name}, ${DATA.kind} ${own.name}` : run.name;
          const isFew = DATA.runs.length <= 8;
          single.push({ x, y: scaled(own[metric.name]), name: plain(title), legendgroup: key, mode: isFew ? "lines+markers" : "lines", marker: { size: 4 }, line: { color: faded(groupPaint(run.group), !n || isLonely && isSingle ? 1 : isFew ? .45 : .25), width: n ? 1 : 2 }, showlegend: n ? isFew && (!isLonely || parts.length > 1) : true });
        }
      }
      const xaxis = over === "seconds" ? { title: "seconds of training" } : { title: "training steps", type: over === "log" ? "log" : "linear" };
      draw("learning-chart", [...single, ...traces], xaxis, { title: metric.is_rate ? `${metric.label} (%)` : metric.label, ...(metric.is_rate ? { range: [-2, 103] } : {}) });
      byId("learning-said").textContent = isLonely && hasWilson
        ? "The band is the 95% interval (Wilson) of the success rate from the episodes of each evaluation."
        : n ? "Thick lines are interquartile means over the runs of a group (all together: and over the graphs), bands their 95% stratified bootstrap intervals; a single run has none." : "Each line is a run.";
    });
  }

  if (byId("goal-chart")) {
    fill(byId("goal-run"), DATA.goals.map((row, index) => [index, row.run]));
    listen(["goal-mode", "goal-run"], () => {
      const mode = byId("goal-mode").value, isTraining = mode === "training";
      byId("goal-run-label").hidden = !isTraining;
      if (isTraining) {
        const row = DATA.goals[byId("goal-run").value];
        const shares = inOrder(row.training?.shares ?? [], ([name]) => name);
        const paints = ["#0072B2", "#D55E00", "#CC79A7", "#E69F00", "#56B4E9", "#8c6d5a"];
        draw("goal-chart", shares.map(([name, values], at) => {
          const [, kind, number] = /^(key|door) (\d+)$/.exec(name) ?? [], index = kind ? number - 1 : at;
          const line = { color: name === "exit" ? colourOf("good") : paints[index % paints.length], dash: kind === "door" ? "dash" : DASHES[Math.floor(index / paints.length) % DASHES.length], width: 2 };
          return { x: row.training.steps, y: values.map((value) => 100 * value), name: plain(name), mode: "lines", line };
        }),
          { title: "training steps" }, { title: "episodes that achieve it (%)", range: [-2, 103] });
        byId("goal-said").textContent = row.training ? "Episodes of training, as they were played: each point is the mean over at least ten of them." : "This run has no table of its training's episodes, or too few rows (fewer than 20).";
        return;
      }
      draw("goal-chart", DATA.goals.map((row, index) => ({
        type: "bar", name: plain(row.run), x: row.goals.map((goal) => plain(goal.name)), marker: { color: faded(groupPaint(row.group), Math.max(.3, .95 - .14 * DATA.goals.filter((other, at) => at < index && other.group === row.group).length)) },
        y: row.goals.map((goal) => mode === "share" ? 100 * goal.share : goal.mean_step),
        hovertext: row.goals.map((goal) => `${plain(row.run)}<br>${plain(goal.name)}: ${goal.mean_step === null ? "never" : goal.mean_step.toFixed(1) + " steps"}, ${(100 * goal.share).toFixed(1)}% of episodes`), hoverinfo: "text",
      })), { title: "", type: "category", categoryorder: "array", categoryarray: inOrder(DATA.goals.flatMap((row) => row.goals.map((goal) => goal.name))).map(plain) }, mode === "share" ? { title: "episodes that achieve it (%)", range: [0, 103] } : { title: "mean step", rangemode: "tozero" });
      byId("goal-said").textContent = `Played for this report by the newest checkpoints with ${DATA.is_greedy ? "the most probable" : "sampled"} actions, ${DATA.goals[0].episodes} episodes each, on levels that training never sees.`;
    });
  }

  if (byId("complexity-chart")) {
    fill(byId("measure"), Object.entries(DATA.measures));
    fill(byId("success-level"), ["95", "90", "50"].map((level) => [level, `${level}% success`]));
    listen(["measure", "success-level", "log-steps"], () => {
      const measure = byId("measure").value, level = byId("success-level").value;
      const at = (point) => DATA.complexity.find((row) => row.graph === point.graph && row.drop_key === point.drop_key)?.measures[measure];
      const isLog = byId("log-steps").checked;
      const isOpen = (point) => point.steps_to[level] === null, isFirst = (point) => isLog && point.steps_to[level] === 0;
      const steps = (point) => isOpen(point) ? 1.25 * 1.07 ** point.group * point.last : point.steps_to[level]; // groups apart
      const foot = Math.min(...DATA.points.flatMap((point) => [point.last, steps(point)]).filter((value) => value > 0)) / 2; // a logarithmic axis has no 0
      const traces = DATA.groups.flatMap(({ label }, number) => {
        const colour = groupPaint(number), symbol = SYMBOLS[Math.floor(number / new Set(DATA.groups.map((one) => one.colour)).size) % SYMBOLS.length];
        const points = DATA.points.filter((point) => point.group === number && at(point) !== undefined);
        if (!points.length) return [];
        const hasRoom = points.map((point) => point.graph).join("").length <= 60; // else names lie over each other
        return [{
          x: points.map(at), y: points.map((point) => isFirst(point) ? foot : steps(point)),
          text: points.map((point) => hasRoom ? plain(point.graph) : ""), textposition: "top center", mode: "markers+text", name: plain(label),
          marker: { color: colour, size: 11, symbol: points.map((point) => isOpen(point) ? "triangle-up-open" : isFirst(point) ? "triangle-down-open" : symbol), line: { width: 1.5, color: colour } },
          hovertext: points.map((point) => `${plain(label)}, ${DATA.kind} ${plain(point.label)}, ${point.n} runs<br>${isOpen(point) ? "not reached in " + count(point.last) : count(point.steps_to[level])} steps`), hoverinfo: "text",
        }];
      });
      const heights = traces.flatMap((trace) => trace.y);
      const scale = isLog ? { type: "log", dtick: "D2", tickformat: "~s", range: [Math.log10(Math.min(...heights) / 1.6), Math.log10(1.6 * Math.max(...heights))] } : { rangemode: "tozero" };
      draw("complexity-chart", traces, { title: DATA.measures[measure], rangemode: "tozero" }, { title: `steps to ${level}% success`, ...scale });
    });
  }
  document.documentElement.dataset.charts = "drawn";
})();
