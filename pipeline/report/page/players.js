"use strict";
// Players: a walker in front of a camera that can be dragged, eigenwalkers, and the two candidates of a limb.
const Players = (() => {
  const BONES = JSON.parse(document.getElementById("bones").textContent);
  const RIGHT = new Set([5, 6, 7, 12, 13, 14]);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const id = name => document.getElementById(name);
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const rad = degrees => degrees * Math.PI / 180;
  const data = name => { const at = id(name); return at ? JSON.parse(at.textContent) : null; };
  const loops = [], SLICE_MS = 8;  // computing time within a frame

  // Canvas at its size on the screen; `scale` converts millimetres to pixels, `middle` is shown at its centre.
  class Stage {
    constructor(canvas, high, middle) {
      Object.assign(this, { canvas, high, middle, context: canvas.getContext("2d"), seen: true, azimuth: 0.6, lift: 0.18 });
      new IntersectionObserver(entries => { this.seen = entries[0].isIntersecting; }).observe(canvas);
    }
    begin() {
      const { canvas } = this, ratio = Math.min(devicePixelRatio || 1, 2);
      const [w, h] = [canvas.clientWidth || 300, canvas.clientHeight || 300];
      if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
        canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
      }
      this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
      this.context.clearRect(0, 0, w, h);
      [this.w, this.h] = [w, h];
      this.scale = Math.min(h / this.high, w / (this.wide ?? this.high * 0.75));
    }
    place(u, v) { return [this.w / 2 + (u - this.middle[0]) * this.scale, this.h / 2 - (v - this.middle[1]) * this.scale]; }
    turned(x, y, z) {
      const c = Math.cos(this.azimuth), s = Math.sin(this.azimuth);
      return this.place(c * x + s * y, z * Math.cos(this.lift) + (-s * x + c * y) * Math.sin(this.lift));
    }
    line(points, colour, width = 1, dash = []) {
      const g = this.context;
      g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.lineCap = g.lineJoin = "round";
      g.beginPath();
      points.forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y));
      g.stroke(); g.setLineDash([]);
    }
    dot([x, y], radius, colour, hollow = false) {
      const g = this.context;
      g.beginPath(); g.arc(x, y, radius, 0, 2 * Math.PI);
      if (hollow) { g.fillStyle = ink("--soft"); g.fill(); g.strokeStyle = colour; g.lineWidth = 1.6; g.stroke(); } else { g.fillStyle = colour; g.fill(); }
    }
    skeleton(joints, project, colour, { width = 2.4, dash = [], radius = 3.2, fade = true, hollow = null, alpha = 1 } = {}) {
      const at = Array.from({ length: 15 }, (_, j) => project(joints[3 * j], joints[3 * j + 1], joints[3 * j + 2]));
      const g = this.context;
      for (const [a, b] of BONES) { g.globalAlpha = alpha * (fade && (RIGHT.has(a) || RIGHT.has(b)) ? 0.62 : 1); this.line([at[a], at[b]], colour, width, dash); }
      g.globalAlpha = 1;
      if (radius) at.forEach((p, j) => this.dot(p, hollow?.[j] ? radius + 1.5 : radius, colour, Boolean(hollow?.[j])));
      return at;
    }
    // Ring on the ground, with an arrow in the direction of the unit vector [px, py].
    floor(height, reach, [px, py] = [0, 1]) {
      const ring = Array.from({ length: 49 }, (_, i) => this.turned(reach * Math.cos(i * Math.PI / 24), reach * Math.sin(i * Math.PI / 24), height));
      this.line(ring, ink("--line"), 1);
      for (const [x, y] of [[1, 0], [0, 1]]) this.line([this.turned(-reach * x, -reach * y, height), this.turned(reach * x, reach * y, height)], ink("--line"), 1);
      const arrow = [[0, reach], [-60, reach - 110], [60, reach - 110], [0, reach]];
      this.line(arrow.map(([x, y]) => this.turned(py * x + px * y, py * y - px * x, height)), ink("--muted"), 1.5);
    }
  }
  // Walking direction, as the camera sees it, for a view angle in degrees.
  const heading = degrees => degrees === 0 ? "straight away" : Math.abs(degrees) >= 90 ? `across, to the ${degrees > 0 ? "right" : "left"}`
    : `${Math.abs(degrees)}° off to the ${degrees > 0 ? "right" : "left"}`;
  function drag(canvas, move, begin = () => {}) {
    let from = null;
    canvas.addEventListener("pointerdown", e => { from = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); begin(e); });
    canvas.addEventListener("pointermove", e => {
      if (!from) return;
      move(e.clientX - from[0], e.clientY - from[1], e);
      from = [e.clientX, e.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { from = null; });
  }
  function orbit(stage, stop) {
    drag(stage.canvas, (dx, dy) => {
      stage.azimuth -= dx * 0.01; stage.lift = Math.max(-0.1, Math.min(1.4, stage.lift + dy * 0.01));
    }, stop);
  }
  function play(button, playing) {
    const show = () => { button.textContent = playing.on ? "Pause" : "Play"; button.setAttribute("aria-pressed", String(playing.on)); };
    button.addEventListener("click", () => { playing.on = !playing.on; show(); });
    show();
  }
  // A loop draws while one of its stages is on the screen; its clock stops while it is paused.
  function loop(playing, stages, draw) {
    const entry = { playing, stages, draw, clock: 0 };
    loops.push(entry);
    return entry;
  }
  let last = 0;
  function tick(now) {
    const step = Math.min(now - last, 60) / 1000; last = now;
    for (const l of loops) {
      if (!l.stages.some(stage => stage.seen)) continue;
      if (l.playing.on) l.clock += step;
      l.draw(l.clock, l.playing.on ? step : 0);
    }
    requestAnimationFrame(tick);
  }

  function reconstruction(people, table) {
    const root = id("player");
    if (!root) return null;
    const who = id("walker"), view = id("view"), sigma = id("sigma"), count = id("count");
    people.names.forEach((name, r) => who.add(new Option(Charts.words(name), r)));
    who.value = people.shown;
    const methods = id("methods");
    Object.entries(Gait.METHODS).forEach(([key, method]) => {
      const label = methods.appendChild(document.createElement("label"));
      label.innerHTML = `<input type="radio" name="method" value="${key}"> <span class="swatch"></span> `;
      label.querySelector(".swatch").style.setProperty("--ink", `var(--c-${Charts.roles(method.role)})`);
      label.append(method.label);
      label.querySelector("input").defaultChecked = key === "map";
      if (method.note) id("notes").append(`${method.note} `);
    });
    const [low, high] = people.sigma2_range_mm2;
    sigma.max = 100; sigma.value = 100 * Math.log(people.sigma2_mm2 / low) / Math.log(high / low);
    count.max = Math.min(60, Gait.fold(people, +who.value).count); count.value = people.components;
    const image = new Stage(id("seen"), 1950, [0, -110]), turn = new Stage(id("turned"), 2250, [0, -130]), ring = new Stage(id("ring"), 2600, [0, 0]);
    turn.wide = 2300; ring.wide = 2600; ring.lift = Math.PI / 2; ring.azimuth = 0;
    const playing = { on: !still }, spin = { on: !still };
    play(id("play"), playing);
    const turning = id("turn");
    turning.setAttribute("aria-pressed", String(spin.on));
    turning.addEventListener("click", () => { spin.on = !spin.on; turning.setAttribute("aria-pressed", String(spin.on)); });
    orbit(turn, () => { spin.on = false; turning.setAttribute("aria-pressed", "false"); });
    const bound = degrees => Math.max(+view.min, Math.min(+view.max, degrees));
    const setView = degrees => { view.value = Math.round(bound(degrees)); changed(); };
    let exact = +view.value;
    drag(image.canvas, dx => { exact = bound(exact + dx * 0.4); setView(exact); }, () => { exact = +view.value; });
    const aim = e => {
      const box = ring.canvas.getBoundingClientRect();
      const x = e.clientX - box.left - box.width / 2, y = -(e.clientY - box.top - box.height / 2);
      setView(Math.atan2(x, -y) * 180 / Math.PI);
    };
    drag(ring.canvas, (dx, dy, e) => aim(e), aim);

    const figure = JSON.parse(document.querySelector('[data-figure="zhang2007_fig5"][data-spec]').dataset.spec);
    const spec = { ...figure, y_label: "error in depth (mm)", references: [], limits: figure.limits?.map(Math.sqrt) };
    const [method, viewed, rms] = ["method", "view_angle_deg", "rms_error_mm"].map(name => table.header.indexOf(name));
    const published = Charts.series(figure).map(s => ({ ...s, name: `all walkers, ${s.name} (figure 5)`, width: 1.2, dash: "5 3",
      points: table.rows.filter(row => row[method] === s.key).map(row => ({ x: Number(row[viewed]), y: Number(row[rms]), lo: NaN, hi: NaN })) }));
    const current = { key: "own", name: "this walker, now", points: [], colour: "blue", dash: "", width: 2.6 };
    let chart = null;
    const state = { method: "map" };
    function sigma2() { return low * (high / low) ** (sigma.value / 100); }
    let waiting = false;
    function changed() { if (!waiting) { waiting = true; requestAnimationFrame(() => { waiting = false; compute(); }); } }
    function compute() {
      const r = +who.value, n = +count.value, angle = rad(+view.value), noise = sigma2(), fold = Gait.fold(people, r);
      Object.assign(state, { r, n, angle, noise, fold, method: root.querySelector("input[name=method]:checked").value });
      id("view-now").textContent = heading(+view.value);
      id("sigma-now").textContent = `${Charts.say(Number(noise.toPrecision(3)))} mm²`;
      id("count-now").textContent = `${n} of ${fold.count}`;
      view.setAttribute("aria-valuetext", heading(+view.value));
      sigma.setAttribute("aria-valuetext", `${noise.toPrecision(3)} square millimetres`);
      const active = Gait.METHODS[state.method];
      sigma.disabled = !active.prior; count.disabled = !active.estimate;
      const body = id("numbers");
      body.replaceChildren();
      for (const [key, method] of Object.entries(Gait.METHODS)) {
        const estimate = Gait.reconstruct(fold, key, n, angle, noise), e = Gait.errors(people, r, estimate.delta, angle);
        const walk = Gait.combine(fold.walker, estimate.missing, angle);
        if (key === state.method) state.found = walk;
        const row = body.insertRow();
        row.className = key === state.method ? "chosen" : "";
        const head = row.appendChild(document.createElement("th"));
        head.scope = "row"; head.textContent = method.label;
        for (const v of [e.rms.toFixed(1), Gait.angleError(fold.walker, walk).toFixed(1), e.relative.toFixed(2)]) row.insertCell().textContent = v;
      }
      state.cloud = (active.cloud?.(fold, angle) ?? []).map(missing => Gait.combine(fold.walker, missing, angle));
      id("bars").textContent = active.words?.(fold, angle) ?? "";
      current.colour = Charts.roles(active.role);
      if (!chart) {
        chart = new Charts.Chart(id("player-curve"), { series: [...published, current],
          spec: { ...spec, held: true } });
        chart.onmove = setView;
      }
      curve();
      id("player-curve").querySelector("svg").setAttribute("aria-label", `error of ${people.names[r]} against view angle`);
    }
    // Error of this walker from every view, every tenth view first.  Some methods need milliseconds for a view, so their
    // curves grow from frame to frame.
    let filling = 0;
    function curve() {
      const { r, n, noise, fold, method } = state, errorAt = new Map(), run = ++filling;
      const left = [10, 1].flatMap(step => people.views_deg.filter((_, i) => i % step === 0));
      const some = () => {
        if (run !== filling) return;
        for (const began = performance.now(); left.length && performance.now() - began < SLICE_MS;) {
          const x = left.shift();
          if (!errorAt.has(x)) errorAt.set(x, Gait.errors(people, r, Gait.reconstruct(fold, method, n, rad(x), noise).delta, rad(x)).rms);
        }
        current.points = people.views_deg.filter(x => errorAt.has(x)).map(x => ({ x, lo: NaN, hi: NaN, y: errorAt.get(x) }));
        chart.draw();
        chart.at(+view.value);
        if (left.length) requestAnimationFrame(some);
      };
      some();
    }
    for (const control of [who, view, sigma, count]) control.addEventListener("input", changed);
    who.addEventListener("input", () => { count.max = Math.min(60, Gait.fold(people, +who.value).count); });
    methods.addEventListener("change", changed);
    root.addEventListener("reset", () => setTimeout(() => { who.value = people.shown; count.value = people.components;
      sigma.value = 100 * Math.log(people.sigma2_mm2 / low) / Math.log(high / low); view.value = 0; changed(); }));
    function draw(clock, step) {
      const cycle = clock * people.frequency_hz[state.r], real = Gait.posture(state.fold.walker, cycle), result = Gait.posture(state.found, cycle);
      const c = Math.cos(state.angle), s = Math.sin(state.angle), colour = ink(`--c-${current.colour}`), grey = ink("--truth");
      image.begin();
      image.skeleton(real, (x, y, z) => image.place(c * x + s * y, z), ink("--text"), { width: 3, radius: 4, hollow: people.estimated?.[state.r] });
      if (spin.on) turn.azimuth += step * 0.5;
      turn.begin();
      turn.floor(-960, 950);
      const camera = (stage, height, reach) => {
        const [x, y] = [s * reach, -c * reach], eye = stage.turned(x, y, height), [tx, ty] = [c * 90, s * 90];
        stage.line([stage.turned(x, y, height), stage.turned(0, 0, height)], ink("--accent"), 1.2, [5, 5]);
        stage.line([stage.turned(x - tx, y - ty, height), stage.turned(x + tx, y + ty, height), stage.turned(x * 0.84, y * 0.84, height), stage.turned(x - tx, y - ty, height)], ink("--accent"), 2);
        stage.dot(eye, stage === ring ? 9 : 4, ink("--accent"));
      };
      camera(turn, -960, 950);
      for (let j = 0; j < 15; j++) turn.line([turn.turned(...real.subarray(3 * j, 3 * j + 3)), turn.turned(...result.subarray(3 * j, 3 * j + 3))], ink("--bad"), 1);
      turn.skeleton(real, (x, y, z) => turn.turned(x, y, z), grey, { width: 3, radius: 2.5, dash: [6, 5] });
      for (const drawn of state.cloud) turn.skeleton(Gait.posture(drawn, cycle), (x, y, z) => turn.turned(x, y, z), colour, { width: 1.5, radius: 0, alpha: 0.3 });
      turn.skeleton(result, (x, y, z) => turn.turned(x, y, z), colour, { width: 3, radius: 3.4, hollow: people.estimated?.[state.r] });
      ring.begin();
      ring.floor(0, 950);
      ring.skeleton(real, (x, y, z) => ring.turned(x, y, 0), grey, { width: 1.6, radius: 0 });
      camera(ring, 0, 1080);
    }
    compute();
    loop(playing, [image, turn, ring], draw).clock = 0.25;
    return { draw, state, setView, compute };
  }

  function eigenwalkers(people) {
    const sliders = id("eigen-sliders");
    if (!sliders) return;
    const model = Gait.fold(people, -1), stage = new Stage(id("eigen"), 2050, [0, -120]), many = Math.min(6, model.count);
    stage.wide = 1500;
    const inputs = [];
    for (let k = 0; k < many; k++) {
      const row = sliders.appendChild(document.createElement("label"));
      row.append(`${k + 1} · ${(100 * model.values[k] / model.total).toFixed(1)} % of the variance`);
      const input = row.appendChild(Object.assign(document.createElement("input"), { type: "range", min: -3, max: 3, step: 0.1, value: 0 }));
      const out = row.appendChild(document.createElement("output"));
      const show = () => { out.textContent = `${Number(input.value).toFixed(1).replace("-", "−")} sd`; input.setAttribute("aria-valuetext", out.textContent); };
      input.addEventListener("input", () => { show(); sway.at = -1; pressed(); });
      inputs.push({ input, show }); show();
    }
    const playing = { on: !still }, sway = { at: -1, since: 0 }, button = id("sway");
    const pressed = () => button.setAttribute("aria-pressed", String(sway.at >= 0));
    const set = (k, value) => { inputs[k].input.value = value; inputs[k].show(); };
    button.addEventListener("click", () => { sway.at = sway.at >= 0 ? -1 : 0; sway.since = 0; inputs.forEach((_, k) => set(k, 0)); pressed(); });
    id("eigen-reset").addEventListener("click", () => { sway.at = -1; inputs.forEach((_, k) => set(k, 0)); pressed(); });
    // Set the sliders to a walker's coefficients, within their range.
    people.sway = walker => inputs.forEach((_, k) => {
      let along = 0;
      for (let i = 0; i < Gait.SIZE; i++) along += (walker[i] - model.mean[i]) * model.E[k * Gait.SIZE + i];
      sway.at = -1; pressed();
      set(k, Math.max(-3, Math.min(3, along / Math.sqrt(model.values[k]))));
    });
    play(id("eigen-play"), playing); pressed();
    orbit(stage, () => {});
    const w = new Float64Array(Gait.SIZE);
    loop(playing, [stage], (clock, step) => {
      if (sway.at >= 0) {
        sway.since += step || 1 / 60;
        set(sway.at, 3 * Math.sin(sway.since * 1.6));
        if (sway.since * 1.6 > 2 * Math.PI) { set(sway.at, 0); sway.at = (sway.at + 1) % many; sway.since = 0; }
      }
      w.set(model.mean);
      inputs.forEach(({ input }, k) => {
        const amount = input.value * Math.sqrt(model.values[k]);
        if (amount) for (let i = 0; i < w.length; i++) w[i] += amount * model.E[k * Gait.SIZE + i];
      });
      stage.begin();
      stage.floor(-960, 800);
      stage.skeleton(Gait.posture(model.mean, clock), (x, y, z) => stage.turned(x, y, z), ink("--truth"), { width: 2, radius: 0, dash: [5, 5] });
      stage.skeleton(Gait.posture(w, clock), (x, y, z) => stage.turned(x, y, z), ink("--c-blue"), { width: 3, radius: 3.4 });
    });
  }

  function limbs(packed) {
    const clip = id("clip");
    if (!clip) return;
    const camera = id("camera"), limb = id("limb"), frame = id("frame");
    packed.clips.forEach((c, n) => clip.add(new Option(Charts.words(c.name) + (c.action ? ` (${c.action})` : ""), n)));
    packed.cameras.forEach((name, n) => camera.add(new Option(name, n)));
    packed.limbs.forEach((name, n) => limb.add(new Option(Charts.words(name), n)));
    limb.value = Math.max(0, packed.limbs.indexOf("left_knee"));
    const image = new Stage(id("limb-image"), 1, [0, 0]), world = new Stage(id("limb-world"), 1950, [0, 0]);
    world.wide = 1950;
    const playing = { on: !still };
    play(id("limb-play"), playing);
    orbit(world, () => {});
    let now = null, chart = null, entered = "";
    function compute() {
      const c = packed.clips[clip.value], seen = c.seen[camera.value], [parent, child] = packed.ends[limb.value], F = c.frames;
      const truth = Gait.dequantise(c.truth), made = Gait.dequantise(seen.positions), pixels = Gait.dequantise(seen.images), P = Gait.floats(seen.matrix);
      const at = (a, f, j) => [0, 1, 2].map(x => a[f * 45 + 3 * j + x]);
      const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
      let radius = 0;
      for (let f = 0; f < F; f++) radius += distance(at(made, f, parent), at(made, f, child)) / F;
      const rows = [];
      for (let f = 0; f < F; f++) {
        const ray = Gait.ray(P.subarray(12 * f, 12 * f + 12), pixels[f * 30 + 2 * child], pixels[f * 30 + 2 * child + 1]);
        const from = at(made, f, parent), found = Gait.candidates(ray, from, radius), own = at(made, f, child), real = at(truth, f, child);
        const nearer = distance(own, found.near) <= distance(own, found.far);
        const depth = (p, q) => ray.way.reduce((sum, w, i) => sum + w * (p[i] - q[i]), 0);
        rows.push({ ...found, own, real, chosen: nearer ? found.near : found.far, mirror: nearer ? found.far : found.near,
          depths: [depth(found.near, from), depth(found.far, from), depth(own, from), depth(real, at(truth, f, parent))], nearer });
      }
      let root = [0, 0, 0];
      for (let f = 0; f < F; f++) root = root.map((v, x) => v + truth[f * 45 + 24 + x] / F);
      if (entered !== `${clip.value} ${camera.value}`) {  // turn the scene so that depth runs across the picture
        entered = `${clip.value} ${camera.value}`;
        const { way } = Gait.ray(P.subarray(12 * (F >> 1), 12 * (F >> 1) + 12), pixels[(F >> 1) * 30], pixels[(F >> 1) * 30 + 1]);
        world.azimuth = Math.atan2(way[1], way[0]) + 0.35;
      }
      const us = [], vs = [];
      for (let i = 0; i < pixels.length; i += 2) { us.push(pixels[i]); vs.push(pixels[i + 1]); }
      const range = [Math.min(...us), Math.max(...us), Math.min(...vs), Math.max(...vs)];
      image.high = (range[3] - range[2]) * 1.12; image.wide = (range[1] - range[0]) * 1.12;
      image.middle = [(range[0] + range[1]) / 2, -(range[2] + range[3]) / 2];
      world.root = root;
      const margin = seen.margin[limb.value], sure = seen.confidence[limb.value];
      const wrong = rows.filter(r => distance(r.real, r.chosen) > distance(r.real, r.mirror)).length;
      now = { c, seen, truth, made, pixels, parent, child, rows, F, sure };
      frame.max = F - 1;
      id("sure").textContent = `${Charts.words(packed.limbs[limb.value])}: the mirror costs ${margin >= 999 ? "far more" : margin.toFixed(2) + " times as much"}, so the choice is ${sure.replace("_", " ")}. `
        + `The truth is nearer to the other candidate in ${wrong} of ${F} frames.`;
      id("sure").dataset.sure = sure;
      const line = (name, i, colour, dash, width) => ({ name, parts: [], colour, dash, width, points: rows.map((r, f) => ({ x: f, y: r.depths[i], lo: NaN, hi: NaN })) });
      chart = new Charts.Chart(id("limb-curve"), { series: [line("near candidate", 0, "grey", "2 3", 1.2), line("far candidate", 1, "grey", "7 4", 1.2),
        line("reconstructed", 2, Charts.roles(sure), "", 2.6), line("truth", 3, "black", "", 1.2)],
        spec: { x_label: "frame", y_label: "depth relative to the parent (mm)", start: +frame.value } });
      chart.onmove = f => { frame.value = f; playing.on = false; id("limb-play").textContent = "Play"; id("limb-play").setAttribute("aria-pressed", "false"); };
    }
    for (const control of [clip, camera, limb]) control.addEventListener("input", compute);
    frame.addEventListener("input", () => { if (playing.on) id("limb-play").click(); });
    let shownFrame = -1;
    compute();
    const entry = loop(playing, [image, world], clock => {
      if (playing.on) frame.value = Math.floor(clock * 30) % now.F;
      const f = +frame.value, row = now.rows[f], { parent, child } = now;
      if (f !== shownFrame) { shownFrame = f; chart.at(f); id("frame-now").textContent = `${f + 1} of ${now.F}`; }
      const colour = ink(`--c-${Charts.roles(now.sure)}`);
      image.begin();
      const spot = j => image.place(now.pixels[f * 30 + 2 * j], -now.pixels[f * 30 + 2 * j + 1]);
      for (const [a, b] of BONES) image.line([spot(a), spot(b)], ink("--text"), a === parent && b === child ? 4 : 2);
      image.line([spot(parent), spot(child)], colour, 4); image.dot(spot(child), 5, colour);
      world.begin();
      const [rx, ry, rz] = world.root, to = p => world.turned(p[0] - rx, p[1] - ry, p[2] - rz);
      const joints = a => Float64Array.from({ length: 45 }, (_, i) => a[f * 45 + i] - world.root[i % 3]);
      const project = (x, y, z) => world.turned(x, y, z);
      world.skeleton(joints(now.truth), project, ink("--truth"), { width: 2, radius: 0, dash: [6, 5] });
      world.skeleton(joints(now.made), project, ink(`--c-${Charts.roles("reconstruction")}`), { width: 2.4, radius: 2.4 });
      const own = [0, 1, 2].map(x => now.made[f * 45 + 3 * parent + x]);
      world.line([to(row.near), to(row.far)], ink("--muted"), 1, [3, 4]);
      for (let q = Math.max(0, f - 25); q < f; q++) {
        world.line([to(now.rows[q].mirror), to(now.rows[q + 1].mirror)], ink("--muted"), 1);
        world.line([to(now.rows[q].chosen), to(now.rows[q + 1].chosen)], colour, 1.6);
      }
      world.line([to(own), to(row.mirror)], colour, 2, [4, 4]); world.dot(to(row.mirror), 5.5, colour, true);
      world.line([to(own), to(row.chosen)], colour, 4); world.dot(to(row.chosen), 5.5, colour);
    });
    entry.clock = 0.5;
  }

  // Functions of plug-ins that start with the walkers.
  const additions = [];
  // Return the walkers and their player, or null without walkers.
  function start(tables) {
    const packed = data("walkers"), clipped = data("clips"), people = packed && Gait.people(packed);
    const five = tables("zhang2007_fig5", "table.csv");
    if (people && five) { Experiment.start(people); additions.forEach(begin => begin(people)); }
    // Each player starts in a separate task, after the first screen is drawn.
    const first = () => Gait.fold(people, people.shown);
    const made = {}, begin = { fold: () => people && five && first(), learnt: () => people && five && Object.values(Gait.METHODS).forEach(method => method.missing?.(first(), 0)), player: () => people && five && reconstruction(people, five), eigen: () => people && five && eigenwalkers(people), limb: () => clipped && limbs(clipped), sentence: () => people && five && Experiment.sentence(people) };
    const get = name => { if (!(name in made)) { made[name] = null; made[name] = begin[name](); } return made[name]; };
    const left = Object.keys(begin);
    const next = () => { const name = left.shift(); if (name) { get(name); setTimeout(next, 50); } };
    setTimeout(next, 100);
    requestAnimationFrame(now => { last = now; tick(now); });
    return people && five && { people, get player() { return get("player"); } };
  }
  return { start, additions, Stage, drag, orbit, play, loop, heading, ink, still, bones: BONES };
})();
