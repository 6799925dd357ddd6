// The rig in 3-D on a plain canvas: lines and filled polygons, the farthest drawn first. Lengths in mm, rig frame.
(function () {
  const data = document.getElementById("rig-data"), canvas = document.getElementById("rig-view");
  if (!data) return;
  const scene = JSON.parse(data.textContent), pen = canvas.getContext("2d");
  const choose = document.getElementById("rig-whisk"), slider = document.getElementById("rig-frame");
  const said = document.getElementById("rig-said"), at = document.getElementById("rig-at");
  const EDGE_PX = 34; // free around all of it: room for names
  const START = { turn: -0.95, tilt: 0.5, zoom: 1 };
  let look = { ...START }, whisk = null, frame = 0;

  const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const size = (a) => Math.hypot(a[0], a[1], a[2]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => add([0, 0, 0], a, 1 / (size(a) || 1));

  // What is looked at: the middle of all that there is, or the contact; and how far there is something around it.
  const ends = [[0, 0, 0], [scene.whisker.length, 0, 0], ...scene.cameras.map((c) => c.centre)];
  if (scene.board) ends.push(...boardCorners(scene.board));
  for (const one of scene.whisks) ends.push(...(one.bar || []));
  const least = (points, k) => Math.min(...points.map((p) => p[k])), most = (points, k) => Math.max(...points.map((p) => p[k]));
  const low = [0, 1, 2].map((k) => least(ends, k)), high = [0, 1, 2].map((k) => most(ends, k));
  const all = { middle: low.map((v, k) => 0.5 * (v + high[k])), reach: 0.5 * size(add(high, low, -1)) };
  let shown = { ...all, scale: 1, right: 0, down: 0 }; // px a unit of `seen`, and where its origin stands on the canvas

  function boardCorners({ origin, x, y, squares: [i, j] }) {
    return [[0, 0], [i, 0], [0, j], [i, j]].map(([a, b]) => add(add(origin, x, a), y, b));
  }

  // Perspective from 2.6 times as far as there is something: right, down, and how far away.
  function seen(point, { middle, reach }) {
    const [x, y, z] = add(point, middle, -1);
    const c = Math.cos(look.turn), s = Math.sin(look.turn), ct = Math.cos(look.tilt), st = Math.sin(look.tilt);
    const across = c * x - s * y, away = s * x + c * y;
    const up = ct * z - st * away, depth = ct * away + st * z;
    const near = Math.max(0.05 * reach, 2.6 * reach + depth); // what is behind the eye is not let through
    return [across / near, -up / near, depth];
  }

  // All of it fills the canvas, from wherever it is looked at; the contact stands in its middle.
  function fit() {
    const width = canvas.clientWidth, height = canvas.clientHeight, near = at.value === "contact" && whisk;
    const flat = ends.map((p) => seen(p, all)), spans = [0, 1].map((k) => most(flat, k) - least(flat, k));
    const filling = Math.min((width - 2 * EDGE_PX) / spans[0], (height - 2 * EDGE_PX) / spans[1]);
    const scale = look.zoom * (near ? 1.3 * Math.min(width, height) : filling);
    const [x, y] = near ? [0, 0] : [0, 1].map((k) => 0.5 * (least(flat, k) + most(flat, k)));
    shown = { ...(near ? { middle: whisk.touch, reach: 6 } : all), scale, right: 0.5 * width - scale * x, down: 0.5 * height - scale * y };
  }

  function view(point) {
    const [x, y, depth] = seen(point, shown);
    return [shown.right + shown.scale * x, shown.down + shown.scale * y, depth];
  }

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  let shapes = [];
  const put = (points, style) => shapes.push({ points: points.map(view), ...style });

  function ring(centre, u, v, r, n = 28) {
    return Array.from({ length: n + 1 }, (_, k) => {
      const a = (2 * Math.PI * k) / n;
      return add(add(centre, u, r * Math.cos(a)), v, r * Math.sin(a));
    });
  }

  function sides(direction) {
    const u = unit(cross(direction, Math.abs(direction[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
    return [u, cross(direction, u)];
  }

  function cylinder(from, to, radius, fill, stroke) {
    const along = unit(add(to, from, -1)), [u, v] = sides(along), a = ring(from, u, v, radius, 14), b = ring(to, u, v, radius, 14);
    for (let k = 0; k < 14; k++) put([a[k], a[k + 1], b[k + 1], b[k]], { fill });
    put(a, { stroke });
    put(b, { stroke });
  }

  function drawCamera(camera) {
    const reaching = (share) => camera.corners.map((ray) => add(camera.centre, ray, share * size(camera.centre)));
    const near = reaching(0.16), far = reaching(1);
    far.forEach((corner, k) => {
      put([camera.centre, corner, far[(k + 1) % 4]], { stroke: colour("e2"), thin: true, alpha: 0.35 });
      put([camera.centre, near[k], near[(k + 1) % 4]], { fill: colour("e2"), alpha: 0.25, stroke: colour("e2") });
    });
    put([camera.centre], { dot: 4, fill: colour("e2"), label: camera.name });
  }

  function drawBoard(board) {
    const at = (i, j) => add(add(board.origin, board.x, i), board.y, j);
    for (let i = 0; i < board.squares[0]; i++)
      for (let j = 0; j < board.squares[1]; j++)
        put([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], {
          fill: (i + j) % 2 ? "#f2f2f2" : "#555", alpha: 0.75, stroke: "#888", thin: true });
    put([at(board.squares[0], 0)], { label: "board" });
  }

  // A beam clamped at the base with a point load at the contact: v = δ (3 s² − s³) / 2 up to it, straight beyond.
  function wire(motor, contact) {
    const e = [Math.cos(motor), Math.sin(motor), 0], length = scene.whisker.length;
    if (!contact) return [[0, 0, 0], add([0, 0, 0], e, length)];
    const along = contact[0] * e[0] + contact[1] * e[1], off = add(contact, e, -along), points = [];
    for (let k = 0; k <= 24; k++) {
      const s = ((k / 24) * length) / along;
      const bend = s < 1 ? (3 * s * s - s * s * s) / 2 : 1 + 1.5 * (s - 1);
      points.push(add(add([0, 0, 0], e, s * along), off, bend));
    }
    return points;
  }

  function drawWhisk() {
    if (whisk.bar) cylinder(whisk.bar[0], whisk.bar[1], whisk.radius, colour("rod"), colour("muted"));
    whisk.points.forEach((point, k) => put(wire(whisk.motor[k], point), { stroke: colour("e1"), alpha: 0.18, thin: true }));
    const contact = whisk.points[frame];
    put(wire(whisk.motor[frame], contact), { stroke: colour("e1"), wide: true, front: true });
    put(whisk.points.filter(Boolean), { stroke: colour("e4"), wide: true, front: true });
    const planes = [[0, 1], [1, 2], [2, 0]];
    for (const [a, b] of planes) {
      const stretched = (k) => add([0, 0, 0], whisk.axes[k], scene.factor);
      put(ring(whisk.touch, stretched(a), stretched(b), 1), { stroke: colour("e0"), front: true });
    }
    if (contact) put([contact], { dot: 4, fill: colour("e0"), label: "contact", front: true });
  }

  function drawAxes() {
    ["x", "y", "z"].forEach((name, k) => {
      const tip = [0, 0, 0];
      tip[k] = 30;
      put([[0, 0, 0], tip], { stroke: colour("muted"), thin: true });
      if (at.value === "contact") put([tip], { label: name });
    });
    cylinder([0, 0, -9], [0, 0, 9], 7, colour("line"), colour("muted"));
  }

  function paint(shape) {
    pen.globalAlpha = shape.alpha || 1;
    pen.beginPath();
    shape.points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    if (shape.fill && !shape.dot) {
      pen.fillStyle = shape.fill;
      pen.fill();
    }
    pen.globalAlpha = shape.fill && shape.alpha ? 0.8 : pen.globalAlpha;
    if (shape.stroke) {
      pen.strokeStyle = shape.stroke;
      pen.lineWidth = shape.wide ? 2.6 : shape.thin ? 0.7 : 1.2;
      pen.stroke();
    }
    pen.globalAlpha = 1;
    if (shape.dot) {
      const [x, y] = shape.points[0];
      pen.beginPath();
      pen.arc(x, y, shape.dot, 0, 2 * Math.PI);
      pen.fillStyle = shape.fill;
      pen.fill();
    }
  }

  // A name on whatever lies behind it.
  function write({ label, points: [[x, y]] }) {
    pen.font = "13px system-ui, sans-serif";
    pen.lineWidth = 4;
    pen.strokeStyle = colour("bg");
    pen.strokeText(label, x + 7, y - 6);
    pen.fillStyle = colour("fg");
    pen.fillText(label, x + 7, y - 6);
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(ratio * canvas.clientWidth);
    canvas.height = Math.round(ratio * canvas.clientHeight);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    fit();
    shapes = [];
    scene.cameras.forEach(drawCamera);
    if (scene.board) drawBoard(scene.board);
    drawAxes();
    if (whisk) drawWhisk();
    const depth = (s) => s.points.reduce((sum, p) => sum + p[2], 0) / (s.points.length || 1);
    shapes.sort((a, b) => (a.front ? 1 : 0) - (b.front ? 1 : 0) || depth(b) - depth(a));
    shapes.filter((s) => s.points.length).forEach(paint);
    shapes.filter((s) => s.label).forEach(write);
    canvas.dataset.look = [look.turn, look.tilt, look.zoom].map((v) => v.toFixed(3)).join(" ");
  }

  function tell() {
    if (!whisk) return;
    const touching = whisk.points[frame] ? `slip ${whisk.slip[frame].toFixed(3)} mm` : "not touching";
    said.textContent = `θ = ${whisk.theta[frame].toFixed(2)}°, ${touching}`;
  }

  function show(key) {
    whisk = scene.whisks.find((w) => w.key === key) || whisk;
    if (!whisk) return draw();
    choose.value = whisk.key;
    slider.max = whisk.points.length - 1;
    slider.value = frame = whisk.points.length - 1;
    tell();
    draw();
  }

  function turned(by, tilted, zoomed = 1) {
    look.turn += by;
    look.tilt = Math.max(-1.5, Math.min(1.5, look.tilt + tilted));
    look.zoom = Math.max(0.3, Math.min(40, look.zoom * zoomed));
    draw();
  }

  for (const w of scene.whisks) choose.add(new Option(w.name, w.key));
  choose.addEventListener("change", () => show(choose.value));
  slider.addEventListener("input", () => { frame = Number(slider.value); tell(); draw(); });
  at.addEventListener("change", draw);
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) turned(0.008 * event.movementX, 0.008 * event.movementY);
  });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); turned(0, 0, Math.exp(-0.0012 * event.deltaY)); }, { passive: false });
  const KEYS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1], "+": [0, 0, 1.15], "=": [0, 0, 1.15], "-": [0, 0, 1 / 1.15] };
  canvas.addEventListener("keydown", (event) => {
    if (event.key === "Home") look = { ...START };
    else if (!(event.key in KEYS)) return;
    event.preventDefault();
    turned(...(KEYS[event.key] || [0, 0]));
  });
  document.addEventListener("whisk", (event) => show(event.detail));
  new ResizeObserver(draw).observe(canvas);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  show(scene.whisks.length ? scene.whisks[0].key : "");
})();
