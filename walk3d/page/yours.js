"use strict";
// The reader's walk in the players, from a CSV of joints in rows (time, joint, x, y, z).  The file never leaves the browser.
const Yours = (() => {
  const JOINTS = JSON.parse(document.getElementById("joints").textContent), BLOCKS = 5;
  const STRIDE_HZ = [0.4, 1.6], STEPS = 241, TRAVELLED_MM = 500, MIN_FRAMES = 20;
  const CONTROL = `<label for="own-walk">Your walk<input id="own-walk" type="file" accept=".csv,text/csv"><span></span></label>
    <p class="meta"><output id="own-walk-status">Choose or drop walk.csv or joints.csv of reconstruct, or another CSV with time_s, joint, x_mm, y_mm, z_mm. It stays on your machine.</output></p>`;

  // Return the complete frames (45 numbers each) and their times in seconds.  A file without them is an error.
  function read(text) {
    const { header, rows } = Charts.parse(text.replaceAll("\r", "")), at = (...names) => names.map(name => header.indexOf(name)).find(c => c >= 0) ?? -1;
    const columns = ["x", "y", "z"].map(axis => at(`${axis}_mm`, axis)), [time, joint, stretch] = [at("time_s"), at("joint"), at("stretch")];
    if (columns.some(c => c < 0) || time < 0 || joint < 0) throw new Error(`the file needs the columns time_s, joint, x_mm, y_mm, z_mm (found ${header.slice(0, 8).join(", ")})`);
    const frames = new Map();
    for (const row of rows) {
      const j = JOINTS.indexOf(row[joint]);
      if (j < 0 || (stretch >= 0 && row[stretch] !== rows[0][stretch])) continue;
      const t = Number(row[time]);
      if (!frames.has(t)) frames.set(t, new Float64Array(45).fill(NaN));
      columns.forEach((c, x) => { frames.get(t)[3 * j + x] = Charts.number(row[c]); });
    }
    const complete = [...frames].filter(([t, q]) => Number.isFinite(t) && q.every(Number.isFinite)).sort(([a], [b]) => a - b);
    if (complete.length < MIN_FRAMES) throw new Error(`only ${complete.length} frames have all of the joints ${JOINTS.join(", ")}; at least ${MIN_FRAMES} are needed`);
    return { times: complete.map(([t]) => t - complete[0][0]), frames: complete.map(([, q]) => q) };
  }

  // Align a walk: straight ahead along y, without drift, relative to the mean pelvis.
  function aligned({ times, frames }) {
    const pelvis = 3 * JOINTS.indexOf("pelvis"), n = frames.length, mean = x => frames.reduce((sum, q) => sum + q[pelvis + x], 0) / n;
    const middle = times.reduce((a, b) => a + b, 0) / n, power = times.reduce((sum, t) => sum + (t - middle) ** 2, 0);
    const speed = [0, 1].map(x => times.reduce((sum, t, f) => sum + (t - middle) * frames[f][pelvis + x], 0) / power);
    let ahead = speed;
    if (Math.hypot(...speed) * times.at(-1) < TRAVELLED_MM) {  // on the spot: heading from the hips and shoulders
      const right = [0, 1].map(x => frames.reduce((sum, q) => sum + ["hip", "shoulder"].reduce((s, name) => s + q[3 * JOINTS.indexOf(`right_${name}`) + x] - q[3 * JOINTS.indexOf(`left_${name}`) + x], 0), 0));
      ahead = [-right[1], right[0]];
    }
    const [ax, ay] = ahead.map(v => v / Math.hypot(...ahead)), [mx, my, mz] = [0, 1, 2].map(mean);
    return frames.map((q, f) => Float64Array.from({ length: 45 }, (_, i) => {
      const j = 3 * Math.floor(i / 3), dx = q[j] - mx - speed[0] * (times[f] - middle), dy = q[j + 1] - my - speed[1] * (times[f] - middle);
      return [ay * dx - ax * dy, ax * dx + ay * dy, q[j + 2] - mz][i % 3];
    }));
  }

  function basis(hz, t) { const w = 2 * Math.PI * hz * t; return [1, Math.sin(w), Math.cos(w), Math.sin(2 * w), Math.cos(2 * w)]; }
  function solve(A, b) {  // small symmetric systems with several right-hand sides
    const n = A.length;
    for (let i = 0; i < n; i++) for (let r = i + 1; r < n; r++) {
      const share = A[r][i] / A[i][i];
      for (let c = i; c < n; c++) A[r][c] -= share * A[i][c];
      for (let c = 0; c < b[r].length; c++) b[r][c] -= share * b[i][c];
    }
    for (let i = n - 1; i >= 0; i--) for (let c = 0; c < b[i].length; c++) {
      for (let k = i + 1; k < n; k++) b[i][c] -= A[i][k] * b[k][c];
      b[i][c] /= A[i][i];
    }
    return b;
  }
  function fit(frames, times, hz) {
    const A = Array.from({ length: BLOCKS }, () => new Float64Array(BLOCKS)), b = Array.from({ length: BLOCKS }, () => new Float64Array(45));
    frames.forEach((q, f) => { const at = basis(hz, times[f]); for (let i = 0; i < BLOCKS; i++) { for (let k = 0; k < BLOCKS; k++) A[i][k] += at[i] * at[k]; for (let c = 0; c < 45; c++) b[i][c] += at[i] * q[c]; } });
    const w = solve(A, b), rest = frames.map((q, f) => { const at = basis(hz, times[f]); return q.map((v, c) => v - at.reduce((sum, a, i) => sum + a * w[i][c], 0)); });
    return { w, rest, left: rest.reduce((sum, r) => sum + r.reduce((s, v) => s + v * v, 0), 0) };
  }
  const horizontal = frames => {  // xx, xy, yy of each joint
    const out = new Float32Array(45);
    for (const q of frames) for (let j = 0; j < 15; j++) { const [x, y] = [q[3 * j], q[3 * j + 1]]; [x * x, x * y, y * y].forEach((v, k) => { out[3 * j + k] += v / frames.length; }); }
    return out;
  };

  // Fourier representation at the frequency with the smallest residual, at phase zero, like pipeline/core/fourier.
  function represent(walk) {
    const frames = aligned(walk), duration = walk.times.at(-1), high = STRIDE_HZ[1], low = Math.max(STRIDE_HZ[0], 1 / duration);
    if (low >= high) throw new Error(`the walk lasts ${duration.toFixed(2)} s; at least one stride is needed (${(1 / high).toFixed(2)} s if it is fast)`);
    let hz = low, best = Infinity;
    for (const reach of [(high - low) / 2, (high - low) / STEPS]) {
      const about = reach > 0.1 ? (low + high) / 2 : hz;
      for (let i = 0; i < STEPS; i++) {
        const candidate = Math.max(low, about + reach * (2 * i / (STEPS - 1) - 1)), { left } = fit(frames, walk.times, candidate);
        if (left < best) { best = left; hz = candidate; }
      }
    }
    const { w, rest } = fit(frames, walk.times, hz), [left, right] = ["left", "right"].map(side => 3 * JOINTS.indexOf(`${side}_ankle`) + 1);
    const phase = Math.atan2(w[2][left] - w[2][right], w[1][left] - w[1][right]), samples = new Float64Array(BLOCKS * 45);
    samples.set(w[0]);
    for (const h of [1, 2]) for (let c = 0; c < 45; c++) {  // shift the start of the cycle to phase zero
      const [p, q, turn] = [w[2 * h - 1][c], w[2 * h][c], -h * phase];
      samples[(2 * h - 1) * 45 + c] = p * Math.cos(turn) - q * Math.sin(turn); samples[2 * h * 45 + c] = p * Math.sin(turn) + q * Math.cos(turn);
    }
    const mean = Float64Array.from({ length: 45 }, (_, c) => frames.reduce((sum, q) => sum + q[c], 0) / frames.length);
    return { samples, hz, residual: horizontal(rest), temporal: horizontal(frames.map(q => q.map((v, c) => v - mean[c]))) };
  }

  // Add a walk to the people: it is not a training walk, and its fold is trained on all people.
  function add(people, { samples, hz, residual, temporal }) {
    const r = people.count, longer = (Kind, old, size, added) => { const out = new Kind((r + 1) * size); out.set(old.subarray(0, r * size)); out.set(added, r * size); return out; };
    people.samples = longer(Float64Array, people.samples, Gait.SIZE, samples);
    people.residual = longer(Float32Array, people.residual, 45, residual); people.temporal = longer(Float32Array, people.temporal, 45, temporal);
    people.names[r] = "your walk"; people.person[r] = -1; people.frequency_hz[r] = hz;
    if (people.estimated?.length) people.estimated[r] = new Array(15).fill(0);
    people.folds.delete(r);
    return r;
  }
  function start(people) {
    const panel = document.getElementById("player");
    if (!panel) return;
    document.getElementById("count").closest("label").insertAdjacentHTML("afterend", CONTROL);
    const input = document.getElementById("own-walk"), out = document.getElementById("own-walk-status");
    async function take(file) {
      if (!file) return;
      try {
        const walk = represent(read(await file.text())), r = add(people, walk), who = document.getElementById("walker");
        if (![...who.options].some(option => +option.value === r)) who.add(new Option("your walk", r));
        who.value = r; who.dispatchEvent(new Event("input"));
        people.sway?.(walk.samples);
        out.textContent = `${file.name}: ${walk.hz.toFixed(2)} strides per second. The player and the eigenwalkers above now show this walk; it has not left your machine.`;
      } catch (error) { out.textContent = `cannot show ${file.name}: ${error.message}.`; }
    }
    input.addEventListener("change", () => take(input.files[0]));
    panel.addEventListener("dragover", event => event.preventDefault());
    panel.addEventListener("drop", event => { event.preventDefault(); take(event.dataTransfer.files[0]); });
  }
  Players.additions.push(start);
  return { start, read, represent };
})();
