"use strict";
// One reconstructed walk: image with reprojection, 3D with uncertainty, the view from above, joint angles.
(() => {
  const { Stage, drag, orbit, play, loop, ink, still, bones } = Players;
  const id = name => document.getElementById(name);
  const walk = JSON.parse(id("walk").textContent), F = walk.frames, A = walk.angle_names.length;
  const [points, image, world, half, angles, bars] = ["keypoints", "image", "positions", "half", "angles", "angle_half"]
    .map(name => Gait.dequantise(walk[name]));
  const seen = Uint8Array.from(atob(walk.seen), c => c.charCodeAt(0));
  const frame = id("frame"), playing = { on: !still }, spin = { on: !still };
  frame.max = F - 1;

  const range = (values, first, every, known = () => true) => {
    let low = Infinity, high = -Infinity;
    for (let i = first; i < values.length; i += every) if (known(i)) { low = Math.min(low, values[i]); high = Math.max(high, values[i]); }
    return [low, high];
  };
  const picture = new Stage(id("image"), 1, [0, 0]), space = new Stage(id("world"), 1, [0, 0]), ring = new Stage(id("ring"), 2.5, [0, 0]);
  const [left, right] = range(image, 0, 2), [top, bottom] = range(image, 1, 2);
  Object.assign(picture, { high: (bottom - top) * 1.15, wide: (right - left) * 1.2, middle: [(left + right) / 2, -(top + bottom) / 2] });
  const [low, high] = range(world, 2, 3);
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

  // The 95 % box of a joint as an ellipse of the turned view.
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
    const colour = ink("--c-blue"), at = p => ring.turned(...p), [from, to] = walk.heading_interval_deg;
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

  let chart = null, kind = 0;
  const kinds = [...new Set(walk.angle_names.map(name => name.replace(/^(left|right)_/, "")))];
  kinds.forEach((name, n) => id("joint").add(new Option(name, n)));
  function curves() {
    const lines = ["left", "right"].map((side, n) => {
      const k = walk.angle_names.indexOf(`${side}_${kinds[kind]}`);
      const rows = Array.from({ length: F }, (_, f) => ({ x: f, y: angles[A * f + k], lo: angles[A * f + k] - bars[A * f + k], hi: angles[A * f + k] + bars[A * f + k] }));
      return { name: `${side} ${kinds[kind]}`, parts: [], points: rows.map(p => ({ ...p, x: walk.times_s[p.x] })), colour: ["blue", "orange"][n], dash: n ? "7 4" : "", width: 2.2 };
    });
    chart = new Charts.Chart(id("curve"), { series: lines, note: "bands: 95 %", spec: { x_label: "time (s)", y_label: "angle (°), 0 is straight", start: +frame.value } });
    chart.onmove = x => { stop(); frame.value = walk.times_s.indexOf(x); };
  }
  id("joint").addEventListener("input", () => { kind = +id("joint").value; curves(); });
  curves();

  let shown = -1;
  loop(playing, [picture, space, ring], (clock, step) => {
    if (playing.on) frame.value = Math.floor(clock * walk.rate_hz) % F;
    const f = +frame.value;
    if (f !== shown) {
      shown = f; chart.at(walk.times_s[f]);
      id("frame-now").textContent = `${walk.frame_numbers[f]}, ${walk.times_s[f].toFixed(2)} s`;
    }
    const colour = ink("--c-blue"), spot = (values, j) => picture.place(values[f * 30 + 2 * j], -values[f * 30 + 2 * j + 1]);
    picture.begin();
    picture.line([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]].map(([u, v]) => picture.place(u, -v)), ink("--line"));
    picture.context.globalAlpha = 1;
    for (const [a, b] of bones) {
      picture.context.globalAlpha = [5, 6, 7, 12, 13, 14].some(j => j === a || j === b) ? 0.55 : 1;
      picture.line([spot(image, a), spot(image, b)], colour, 2.4);
    }
    picture.context.globalAlpha = 1;
    for (let j = 0; j < 15; j++) if (seen[f * 15 + j]) picture.dot(spot(points, j), 3, ink("--text"));
    if (spin.on) space.azimuth += step * 0.4;
    space.begin(); space.floor(low, tall * 0.5, direction(walk.heading_deg, 1));
    for (let j = 0; j < 15; j++) if (j !== 8) cloud(f, j, colour);
    const joints = world.subarray(f * 45, f * 45 + 45), project = (x, y, z) => space.turned(x, y, z);
    const at = space.skeleton(joints, project, colour, { width: 3, radius: 0 });
    at.forEach((p, j) => walk.observed[j] ? space.dot(p, 3.6, colour) : space.dot(p, 3.6, colour, true));
    above();
  });
  Players.start(() => null);
})();
