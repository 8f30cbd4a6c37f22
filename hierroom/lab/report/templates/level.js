/* Levels as MiniGrid draws them, on a canvas, and goal graphs. */
const RGB = { red: "#ff0000", green: "#00ff00", blue: "#3b5bff", purple: "#9b45e8", yellow: "#ffff00", grey: "#a0a0a0" };
const T = DATA.tiles;
const decode = (letters) => Uint8Array.from(letters, (letter) => T.letters.indexOf(letter));
const STEP = [[0, 1], [1, 0], [0, -1], [-1, 0]];

/** A canvas of n by n cells in device pixels; returns its context and the side of a cell. */
function prepared(canvas, n) {
  const side = Math.max(4, Math.round((canvas.clientWidth || 300) * (window.devicePixelRatio || 1) / n));
  if (canvas.width !== side * n) canvas.width = canvas.height = side * n;
  return [canvas.getContext("2d"), side];
}

/** Draw the content of one cell; ``numbers`` has for each colour the room that its key opens. */
function drawTile(pen, tile, x, y, side, numbers) {
  pen.fillStyle = "#000";
  pen.fillRect(x, y, side, side);
  if (tile === T.unseen) {
    pen.fillStyle = "#23262c";
    pen.fillRect(x, y, side, side);
    return;
  }
  if (tile === T.wall) {
    pen.fillStyle = "#646464";
    pen.fillRect(x, y, side, side);
    return;
  }
  pen.strokeStyle = "#3a3a3a";
  pen.lineWidth = Math.max(1, side / 32);
  pen.strokeRect(x + .5, y + .5, side, side);
  if (tile === T.exit) {
    pen.fillStyle = RGB.green;
    pen.fillRect(x + 1, y + 1, side - 1, side - 1);
    label(pen, "exit", x, y, side, "#003300", .34);
    return;
  }
  const kind = tile >= T.locked_door ? "locked" : tile >= T.open_door ? "open" : tile >= T.key ? "key" : null;
  if (!kind) return;
  const colour = tile - (kind === "locked" ? T.locked_door : kind === "open" ? T.open_door : T.key);
  const paint = RGB[T.colours[colour]];
  const room = numbers[colour] || "";
  if (kind === "key") {
    pen.strokeStyle = pen.fillStyle = paint;
    pen.lineWidth = side * .11;
    pen.beginPath();
    pen.arc(x + side * .62, y + side * .28, side * .15, 0, 7);
    pen.stroke();
    pen.fillRect(x + side * .565, y + side * .42, side * .11, side * .46);
    pen.fillRect(x + side * .42, y + side * .6, side * .15, side * .09);
    pen.fillRect(x + side * .42, y + side * .77, side * .15, side * .09);
    label(pen, room, x - side * .27, y - side * .2, side, "#fff", .42);
  } else if (kind === "open") {
    pen.strokeStyle = paint;
    pen.lineWidth = side * .1;
    pen.strokeRect(x + side * .08, y + side * .08, side * .84, side * .84);
    label(pen, room, x, y, side, paint, .45);
  } else {
    pen.fillStyle = paint;
    pen.fillRect(x + side * .04, y + side * .04, side * .92, side * .92);
    pen.fillStyle = "rgba(0, 0, 0, .62)";
    pen.fillRect(x + side * .14, y + side * .14, side * .72, side * .72);
    label(pen, room, x, y, side, "#fff", .5);
  }
}

function label(pen, text, x, y, side, colour, size) {
  if (side < 12) return;
  pen.fillStyle = colour;
  pen.font = `600 ${Math.round(side * size)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, x + side / 2, y + side / 2 + side * .03);
}

function drawAgent(pen, x, y, side, direction) {
  pen.save();
  pen.translate(x + side / 2, y + side / 2);
  pen.rotate(direction * Math.PI / 2);
  pen.fillStyle = "#ff3b30";
  pen.strokeStyle = "#fff";
  pen.lineWidth = Math.max(1, side * .05);
  pen.beginPath();
  pen.moveTo(side * .38, 0);
  pen.lineTo(-side * .34, side * .3);
  pen.lineTo(-side * .34, -side * .3);
  pen.closePath();
  pen.fill();
  pen.stroke();
  pen.restore();
}

function frame(pen, x, y, side) {
  pen.strokeStyle = "#fff";
  pen.lineWidth = Math.max(2, side * .12);
  const inset = pen.lineWidth / 2;
  pen.strokeRect(x + inset, y + inset, side - 2 * inset, side - 2 * inset);
}

/** The tile codes that a goal may stand on. */
function tilesOf(goal) {
  if (goal < 0) return [];
  if (goal === 12) return [T.exit];
  return goal >= 6 ? [T.locked_door + goal - 6, T.open_door + goal - 6] : [T.key + goal];
}

/** The tree of rooms with its state: what is held, what is open, where the agent is, what it is after. */
function drawGraph(svg, episode, step, goal) {
  const { key_rooms: keyRooms, exit_room: exitRoom, places } = episode.graph;
  const [across, down, radius] = [86, 84, 19];
  const width = Math.max(1, ...places.map((place) => place[0] + 1)) * across;
  const height = (Math.max(...places.map((place) => place[1])) + 1) * down;
  const at = places.map(([column, depth]) => [across * (column + .5), down * (depth + .45)]);
  const [ink, paper, accent, line] = ["ink", "panel", "accent", "faint"].map(colourOf);
  const parts = [];
  const colour = (room) => RGB[T.colours[episode.colours[room - 1]]];
  const has = (bits, room) => Boolean(bits[step] >> (room - 1) & 1);
  keyRooms.forEach((home, index) => {
    const room = index + 1;
    const [[x1, y1], [x2, y2]] = [at[home], at[room]];
    const isWanted = goal === episode.colours[index];
    parts.push(shape("line", { x1, y1, x2, y2, stroke: line, "stroke-width": 1.5 }));
    const [x, y] = [(x1 + x2) / 2, (y1 + y2) / 2];
    const state = has(episode.keys, room) ? "held" : has(episode.doors, room) ? "used" : "not held";
    if (isWanted) parts.push(shape("rect", { x: x - 15, y: y - 15, width: 30, height: 30, rx: 6, fill: "none", stroke: accent, "stroke-width": 4, class: "wanted" }));
    parts.push(shape("rect", { x: x - 10, y: y - 10, width: 20, height: 20, rx: 3, fill: state === "not held" ? paper : colour(room), stroke: colour(room), "stroke-width": 3, class: "key", "data-room": room, "data-state": state }));
    parts.push(shape("text", { x, y: y + 4.5, "text-anchor": "middle", "font-size": 12, "font-weight": 700, fill: state === "not held" ? ink : "#000" }, room));
  });
  at.forEach(([x, y], room) => {
    const isOpen = room === 0 || has(episode.doors, room);
    const isWanted = room > 0 && goal === 6 + episode.colours[room - 1] || room === exitRoom && goal === 12;
    if (isWanted) parts.push(shape("circle", { cx: x, cy: y, r: radius + 8, fill: "none", stroke: accent, "stroke-width": 4, class: "wanted" }));
    if (room === exitRoom) parts.push(shape("circle", { cx: x, cy: y, r: radius + 4, fill: "none", stroke: colourOf("good"), "stroke-width": 2.5 }));
    const edge = room ? colour(room) : line;
    parts.push(shape("circle", { cx: x, cy: y, r: radius, fill: isOpen ? edge : paper, stroke: edge, "stroke-width": 3, "stroke-dasharray": isOpen ? "none" : "5 4", class: "room", "data-room": room, "data-open": isOpen }));
    const isHere = episode.rooms[step] === room;
    parts.push(shape("text", { x, y: y + (room ? 5.5 : 4), "text-anchor": "middle", "font-size": room ? 15 : 11, "font-weight": 700, fill: room === 0 ? paper : isOpen ? "#000" : ink }, room || "start"));
    if (isHere) parts.push(shape("path", { d: `M ${x + radius + 15} ${y} l -10 -7 l 0 14 z`, transform: `rotate(180 ${x + radius + 10} ${y})`, fill: "#ff3b30", stroke: ink, class: "here", "data-room": room }));
    if (room === exitRoom) parts.push(shape("text", { x: x + radius - 3, y: y + radius + 8, "font-size": 12, fill: colourOf("good"), "font-weight": 600 }, "exit"));
  });
  svg.setAttribute("viewBox", `-6 -6 ${width + 22} ${height + 14}`);
  svg.style.maxHeight = `${Math.max(150, Math.min(380, height * 1.25))}px`;
  svg.replaceChildren(...parts);
}
