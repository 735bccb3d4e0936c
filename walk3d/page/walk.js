"use strict";
// Page of one reconstructed walk: image with reprojection, 3D with uncertainty, view from above, angles over the cycle.
(() => {
  const { Stage, orbit, play, loop, ink, still, bones } = Players;
  const id = name => document.getElementById(name);
  const walk = JSON.parse(id("walk").textContent), F = walk.frames;
  const [points, image, world, half] = ["keypoints", "image", "positions", "half"].map(name => Gait.dequantise(walk[name]));
  const seen = Uint8Array.from(atob(walk.seen), c => c.charCodeAt(0));
  // Key frames of the film.  The image shows the nearest one, and the keypoints and the reconstruction of its frame.
  const film = walk.film.map(([f, jpeg]) => { const photo = new Image(); photo.src = `data:image/jpeg;base64,${jpeg}`; return { f, photo }; });
  const nearest = f => film.length ? film.reduce((a, b) => Math.abs(b.f - f) < Math.abs(a.f - f) ? b : a) : { f };
  const frame = id("frame"), playing = { on: !still }, spin = { on: !still };
  frame.max = F - 1;
  // Colours of left, right and middle joints, the same as in the curves.
  const LEFT = new Set([2, 3, 4, 9, 10, 11]), RIGHT = new Set([5, 6, 7, 12, 13, 14]);
  const side = (...joints) => joints.some(j => LEFT.has(j)) ? "left" : joints.some(j => RIGHT.has(j)) ? "right" : "middle";
  const colours = () => ({ left: ink("--c-blue"), right: ink("--c-orange"), middle: ink("--text") });

  const heights = Array.from({ length: F * 15 }, (_, i) => world[3 * i + 2]), low = Math.min(...heights), high = Math.max(...heights);
  const picture = new Stage(id("image"), 1, [0, 0]), space = new Stage(id("world"), 1, [0, 0]), ring = new Stage(id("ring"), 2.5, [0, 0]);
  // Edges of the part of the image that is drawn, px.
  const [left, top, right, bottom] = walk.part.map((share, k) => share * walk.image_px[k % 2]);
  Object.assign(picture, { high: (bottom - top) * 1.03, wide: (right - left) * 1.03, middle: [(left + right) / 2, -(top + bottom) / 2] });
  const tall = high - low;
  Object.assign(space, { high: tall * 1.22, wide: tall * 1.05, middle: [0, (low + high) / 2 - 0.03 * tall], azimuth: 0.5 });
  Object.assign(ring, { wide: 2.6, lift: Math.PI / 2, azimuth: 0 });

  const button = id("turn");
  const pressed = () => button.setAttribute("aria-pressed", String(spin.on));
  button.addEventListener("click", () => { spin.on = !spin.on; pressed(); });
  orbit(space, () => { spin.on = false; pressed(); });
  play(id("play-button"), playing); pressed();
  const stop = () => { if (playing.on) id("play-button").click(); };
  frame.addEventListener("input", stop);

  // 95 % region of a joint as an ellipse in the turned view.
  function cloud(f, j, colour) {
    const c = Math.cos(space.azimuth), s = Math.sin(space.azimuth), up = Math.cos(space.lift), over = Math.sin(space.lift);
    const rows = [[c, s, 0], [-s * over, c * over, up]], h = [0, 1, 2].map(x => half[f * 45 + 3 * j + x]);
    const dot = (a, b) => a.reduce((sum, v, x) => sum + v * b[x] * h[x] * h[x], 0);
    const [a, b, d] = [dot(rows[0], rows[0]), dot(rows[0], rows[1]), dot(rows[1], rows[1])];
    const middle = (a + d) / 2, off = Math.hypot((a - d) / 2, b), turn = 0.5 * Math.atan2(2 * b, a - d);
    const [x, y] = space.turned(...world.subarray(f * 45 + 3 * j, f * 45 + 3 * j + 3)), g = space.context;
    g.beginPath(); g.fillStyle = colour; g.globalAlpha = 0.11;
    g.ellipse(x, y, Math.sqrt(middle + off) * space.scale, Math.sqrt(Math.max(middle - off, 0)) * space.scale, -turn, 0, 2 * Math.PI);
    g.fill(); g.globalAlpha = 1;
  }
  const direction = (degrees, reach) => [reach * Math.sin(degrees * Math.PI / 180), -reach * Math.cos(degrees * Math.PI / 180), 0];
  function above() {
    ring.begin(); ring.middle = [0, -0.12];
    const colour = ink("--text"), at = p => ring.turned(...p), [from, to] = walk.heading_interval_deg;
    const wedge = [[0, 0, 0], ...Array.from({ length: 25 }, (_, i) => direction(from + (to - from) * i / 24, 0.9)), [0, 0, 0]].map(at);
    const g = ring.context;
    g.beginPath(); wedge.forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y)); g.fillStyle = colour; g.globalAlpha = 0.25; g.fill(); g.globalAlpha = 1;
    ring.line(Array.from({ length: 49 }, (_, i) => at(direction(i * 7.5, 0.9))), ink("--line"));
    for (const degrees of walk.alternatives_deg) ring.line([at([0, 0, 0]), at(direction(degrees, 0.8))], ink("--muted"), 1.6, [5, 4]);
    const tip = direction(walk.heading_deg, 0.82);
    ring.line([at([0, 0, 0]), at(tip)], colour, 3);
    for (const side of [-150, 150]) { const [x, y] = direction(walk.heading_deg + side, 0.16); ring.line([at(tip), at([tip[0] + x, tip[1] + y, 0])], colour, 3); }
    ring.line([[-0.12, -1.3, 0], [0.12, -1.3, 0], [0.12, -1.14, 0], [-0.12, -1.14, 0], [-0.12, -1.3, 0]].map(at), ink("--text"), 2);
    ring.line([[-0.05, -1.14, 0], [-0.09, -1.02, 0], [0.09, -1.02, 0], [0.05, -1.14, 0]].map(at), ink("--text"), 2);
    g.fillStyle = ink("--muted"); g.font = "13px system-ui"; g.textAlign = "left";
    const [x, y] = at([0.2, -1.24, 0]); g.fillText("camera", x, y + 4);
  }

  const NS = "http://www.w3.org/2000/svg";
  function node(parent, name, attributes = {}, words = "") {
    const element = parent.appendChild(document.createElementNS(NS, name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (words) element.textContent = words;
    return element;
  }
  // Curves of both sides over the cycle, over the band of the walkers in the model.
  const W = 330, H = 178, L = 34, B = 22, T = 8, R = 8, SIDES = ["left", "right"];
  const px = percent => L + (W - L - R) * percent / 100;
  const dots = walk.curve_names.map((name, c) => {
    const figure = id("curves").appendChild(document.createElement("figure"));
    figure.appendChild(document.createElement("figcaption")).textContent = name === "trunk" || name === "shank" ? `${name}, to the vertical (°)` : `${name} flexion (°)`;
    const [curve, bar, mean, spread] = [walk.angles[c], walk.angles_half[c], walk.walkers[c], walk.walkers_half[c]];
    const all = SIDES.flatMap((_, s) => curve[s].flatMap((y, i) => [y - bar[s][i], y + bar[s][i]])).concat(mean.flatMap((y, i) => [y - spread[i], y + spread[i]]));
    const low = Math.min(0, ...all), high = Math.max(0, ...all), py = y => T + (H - T - B) * (high - y) / (high - low);
    const svg = node(figure, "svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${name}: left ${Math.min(...curve[0]).toFixed(0)} to ${Math.max(...curve[0]).toFixed(0)}°, right ${Math.min(...curve[1]).toFixed(0)} to ${Math.max(...curve[1]).toFixed(0)}°` });
    const step = [5, 10, 20, 30, 50].find(s => (high - low) / s <= 5) ?? 100;
    for (let y = Math.ceil(low / step) * step; y <= high; y += step) {
      node(svg, "line", { x1: L, x2: W - R, y1: py(y), y2: py(y), class: y ? "grid" : "zero" });
      node(svg, "text", { x: L - 5, y: py(y) + 4, "text-anchor": "end" }, String(y).replace("-", "−"));
    }
    for (const x of [0, 20, 40, 60, 80, 100]) node(svg, "text", { x: px(x), y: H - 6, "text-anchor": x === 100 ? "end" : "middle" }, x === 100 ? "100 %" : x);
    const line = (values, off = 0, by = []) => values.map((y, i) => `${px(100 * i / (values.length - 1)).toFixed(1)},${py(y + off * (by[i] ?? 0)).toFixed(1)}`);
    const band = (values, by, look) => node(svg, "polygon", { points: [...line(values, 1, by), ...line(values, -1, by).reverse()].join(" "), class: look });
    band(mean, spread, "walkers");
    SIDES.forEach((look, s) => band(curve[s], bar[s], `band ${look}`));
    SIDES.forEach((look, s) => {
      node(svg, "line", { x1: px(walk.stance[s]), x2: px(walk.stance[s]), y1: T, y2: H - B, class: `off ${look}` });
      node(svg, "polyline", { points: line(curve[s]).join(" "), class: look });
    });
    // A press on a curve shows the frame that is nearest in the left side's cycle.
    svg.addEventListener("pointerdown", event => {
      const at = svg.getBoundingClientRect(), percent = ((event.clientX - at.left) / at.width * W - L) / (W - L - R) * 100;
      const distance = f => Math.abs((walk.percent[f][0] - percent + 150) % 100 - 50);
      stop(); frame.value = Array.from({ length: F }, (_, f) => f).reduce((a, f) => distance(f) < distance(a) ? f : a, 0);
    });
    const markers = SIDES.map(look => node(svg, "circle", { r: 4, class: `at ${look}` }));
    return f => markers.forEach((dot, s) => {
      const percent = walk.percent[f][s], i = Math.min(99, Math.floor(percent)), y = curve[s][i] + (percent - i) * (curve[s][i + 1] - curve[s][i]);
      dot.setAttribute("cx", px(percent)); dot.setAttribute("cy", py(y));
    });
  });
  // Some postures in the image for printing, all with the same height.
  const strip = node(id("strip"), "svg", { viewBox: "0 0 700 190" });
  for (let n = 0; n < 5; n++) {
    const { f, photo } = nearest(Math.round((F - 1) * n / 4)), coordinate = x => Array.from({ length: 15 }, (_, j) => image[f * 30 + 2 * j + x]);
    const [us, vs] = [coordinate(0), coordinate(1)], head = Math.min(...vs), [margin, tall] = photo ? [22, 124] : [6, 160], scale = tall / (Math.max(...vs) - head);
    const cell = node(strip, "svg", { x: 140 * n, width: 138, height: 172 });
    const place = (u, v) => [69 + (u - us[8]) * scale, margin + (v - head) * scale].map(c => c.toFixed(1)), at = j => place(us[j], vs[j]);
    if (photo) node(cell, "image", { href: photo.src, x: place(left, top)[0], y: place(left, top)[1], width: (right - left) * scale, height: (bottom - top) * scale, preserveAspectRatio: "none" });
    for (const [a, b] of bones) node(cell, "line", { x1: at(a)[0], y1: at(a)[1], x2: at(b)[0], y2: at(b)[1], class: side(a, b) });
    node(strip, "text", { x: 69 + 140 * n, y: 186, "text-anchor": "middle" }, `frame ${walk.frame_numbers[f]}`);
  }

  let shown = -1;
  loop(playing, [picture, space, ring], (clock, step) => {
    if (playing.on) frame.value = Math.floor(clock * walk.rate_hz) % F;
    const f = +frame.value;
    if (f !== shown) {
      shown = f; for (const move of dots) move(f);
      id("frame-now").textContent = `${walk.frame_numbers[f]}, ${walk.times_s[f].toFixed(2)} s`;
    }
    const colourOf = colours(), { f: key, photo } = nearest(f), spot = (values, j) => picture.place(values[key * 30 + 2 * j], -values[key * 30 + 2 * j + 1]);
    picture.begin();
    if (photo?.complete) picture.context.drawImage(photo, ...picture.place(left, -top), (right - left) * picture.scale, (bottom - top) * picture.scale);
    picture.line([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]].map(([u, v]) => picture.place(u, -v)), ink("--muted"));
    // On a film, rims separate the colours from any background.
    if (photo) for (const [a, b] of bones) picture.line([spot(image, a), spot(image, b)], "#000", 5);
    for (const [a, b] of bones) picture.line([spot(image, a), spot(image, b)], photo && side(a, b) === "middle" ? "#CDCDCD" : colourOf[side(a, b)], photo ? 3 : 2.4);
    for (let j = 0; j < 15; j++) if (seen[key * 15 + j]) {
      if (photo) picture.dot(spot(points, j), 3.6, "#000");
      picture.dot(spot(points, j), 2.6, photo ? "#FFF" : ink("--text"));
    }
    if (spin.on) space.azimuth += step * 0.4;
    space.begin(); space.floor(low, tall * 0.5, direction(walk.heading_deg, 1));
    for (let j = 0; j < 15; j++) if (j !== 8) cloud(f, j, colourOf[side(j)]);
    const at = Array.from({ length: 15 }, (_, j) => space.turned(...world.subarray(f * 45 + 3 * j, f * 45 + 3 * j + 3)));
    for (const [a, b] of bones) space.line([at[a], at[b]], colourOf[side(a, b)], 3);
    at.forEach((p, j) => space.dot(p, 3.6, colourOf[side(j)], !walk.observed[j]));
    above();
  });
  Players.start(() => null);
})();
