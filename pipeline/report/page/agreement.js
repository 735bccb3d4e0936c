"use strict";
// The page's own tables computed again in the browser: how far the players' numbers are from those of Python.
const Agreement = (() => {
  const JOINTS = JSON.parse(document.getElementById("joints").textContent), INSTANTS = 40;
  const rad = degrees => degrees * Math.PI / 180, column = (table, name) => table.header.indexOf(name);
  const ofMethod = name => name === "average_walker" ? "baseline" : name;
  const methodsOf = table => [...new Set(table.rows.map(row => ofMethod(row[column(table, "method")])))].filter(m => m in Gait.METHODS);
  const rest = () => new Promise(done => setTimeout(done));

  // Means over walkers of what `each` finds for a fold, a method and a view, against the rows of a table.
  async function means(people, table, views, each, keyed, tell) {
    const sums = new Map(), methods = methodsOf(table);
    for (let r = 0; r < people.count; r++) {
      const fold = Gait.fold(people, r);
      for (const method of methods) for (const degrees of views) {
        const found = Gait.reconstruct(fold, method, people.components, rad(degrees), people.sigma2_mm2);
        const key = `${method} ${degrees}`, sum = sums.get(key) ?? {};
        for (const [name, value] of Object.entries(each(fold, found, rad(degrees), r))) sum[name] = (sum[name] ?? 0) + value / people.count;
        sums.set(key, sum);
      }
      tell((r + 1) / people.count);
      await rest();
    }
    let worst = 0, compared = 0;
    for (const row of table.rows) {
      const sum = sums.get(`${ofMethod(row[column(table, "method")])} ${Number(row[column(table, "view_angle_deg")])}`);
      for (const [name, value] of sum ? keyed(row) : []) { worst = Math.max(worst, Math.abs(sum[name] / value - 1)); compared++; }
    }
    return { worst, compared, methods };
  }

  // Figure 5: errors of all walkers from all views.
  function figureFive(people, table, tell) {
    const wanted = { absolute: "absolute_error_mm2", rms: "rms_error_mm", relative: "relative_error" };
    const each = (fold, { delta }, angle, r) => { const { absolute, rms, relative } = Gait.errors(people, r, delta, angle); return { absolute, rms, relative }; };
    return means(people, table, people.views_deg, each, row => Object.entries(wanted).map(([name, of]) => [name, Number(row[column(table, of)])]), tell);
  }

  // Angles (radians, left and right) of hips, knees, shoulders and elbows, as in pipeline/core/joint_angles.
  const minus = (a, b) => a.map((v, i) => v - b[i]), plus = (a, b) => a.map((v, i) => v + b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2], unit = a => { const n = Math.hypot(...a); return a.map(v => v / n); };
  const cross = (a, b) => [0, 1, 2].map(i => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
  function flexion(q) {
    const at = name => { const j = JOINTS.indexOf(name); return [q[3 * j], q[3 * j + 1], q[3 * j + 2]]; }, out = {};
    const trunk = minus(at("sternum"), at("pelvis"));
    for (const limb of [["hip", "knee", "ankle"], ["shoulder", "elbow", "wrist"]]) {
      const right = unit(minus(at(`right_${limb[0]}`), at(`left_${limb[0]}`))), level = dot(trunk, right);
      const up = unit(trunk.map((v, i) => v - level * right[i])), ahead = cross(up, right), angles = { root: [], middle: [] };
      for (const side of ["left", "right"]) {
        const [start, middle, end] = limb.map(joint => at(`${side}_${joint}`)), upper = unit(minus(middle, start)), lower = unit(minus(end, middle));
        angles.root.push(Math.atan2(dot(upper, ahead), -dot(upper, up)));
        angles.middle.push(2 * Math.atan2(Math.hypot(...minus(upper, lower)), Math.hypot(...plus(upper, lower))));
      }
      out[limb[0]] = angles.root; out[limb[1]] = angles.middle;
    }
    return out;
  }
  const cycle = w => Array.from({ length: INSTANTS }, (_, t) => flexion(Gait.posture(w, t / INSTANTS)));
  function jointAngles(people, table, tell) {
    const views = [...new Set(table.rows.map(row => Number(row[column(table, "view_angle_deg")])))], own = new Map();
    const each = (fold, { missing }, angle, r) => {
      if (!own.has(r)) own.set(r, cycle(fold.walker));
      const real = own.get(r), made = cycle(Gait.combine(fold.walker, missing, angle)), out = {};
      for (const name of Object.keys(real[0])) {
        const squares = [0, 0];
        made.forEach((at, t) => at[name].forEach((v, side) => {
          const off = Math.atan2(Math.sin(v - real[t][name][side]), Math.cos(v - real[t][name][side]));
          squares[side] += off * off / INSTANTS;
        }));
        out[name] = (Math.sqrt(squares[0]) + Math.sqrt(squares[1])) / 2 * 180 / Math.PI;
      }
      return out;
    };
    return means(people, table, views, each, row => [[row[column(table, "angle")], Number(row[column(table, "rmse_deg")])]], tell);
  }

  // Figure 4: largest distance of a reconstructed coordinate, mm.
  function figureFour(people, table) {
    const made = new Map(), instants = new Set(table.rows.map(row => row[column(table, "instant")])).size;
    let worst = 0, compared = 0;
    for (const row of table.rows) {
      const method = row[column(table, "method")], r = people.names.indexOf(row[column(table, "walker")]), degrees = Number(row[column(table, "view_angle_deg")]);
      if (r < 0 || !(method in Gait.METHODS)) continue;
      const key = `${method} ${degrees}`;
      if (!made.has(key)) {
        const fold = Gait.fold(people, r);
        made.set(key, Gait.combine(fold.walker, Gait.reconstruct(fold, method, people.components, rad(degrees), people.sigma2_mm2).missing, rad(degrees)));
      }
      const q = Gait.posture(made.get(key), Number(row[column(table, "instant")]) / instants), j = JOINTS.indexOf(row[column(table, "joint")]);
      "xyz".split("").forEach((axis, x) => { worst = Math.max(worst, Math.abs(q[3 * j + x] - Number(row[column(table, `reconstructed_${axis}_mm`)]))); compared++; });
    }
    return { worst, compared };
  }

  // The button of the walker's player; what is found is in the data of its output, too.
  function start(played, tables) {
    const { people } = played;
    const button = document.getElementById("again"), out = document.getElementById("agreement");
    const percent = share => `${(100 * share).toPrecision(2)} %`;
    async function check() {
      button.disabled = true;
      const [five, four, angles] = ["zhang2007_fig5", "zhang2007_fig4", "zhang2007_joint_angles"].map(name => tables(name, "table.csv"));
      const parts = angles ? 2 : 1, told = [];
      const tell = done => part => { out.textContent = `${Math.round(100 * (done + part) / parts)} %`; };
      const found = await figureFive(people, five, tell(0));
      Object.assign(out.dataset, { worst: found.worst, compared: found.compared, methods: found.methods.join(" ") });
      if (found.compared) told.push(`${found.compared} numbers of figure 5 agree within ${percent(found.worst)}`);
      if (angles) {
        const of = await jointAngles(people, angles, tell(1));
        Object.assign(out.dataset, { angles: of.worst, angled: of.compared });
        if (of.compared) told.push(`${of.compared} errors of joint angles${of.methods.includes("anatomical") ? ", the anatomical method's too," : ""} within ${percent(of.worst)}`);
      }
      if (four) {
        const posture = figureFour(people, four);
        Object.assign(out.dataset, { postures: posture.worst, coordinates: posture.compared });
        told.push(`${posture.compared} coordinates of figure 4 within ${posture.worst.toPrecision(2)} mm`);
      }
      const began = performance.now();
      for (let i = 0; i < 100; i++) played.player.draw(i / 60, 1 / 60);
      out.dataset.drawing = ((performance.now() - began) / 100).toFixed(3);
      const r = Math.floor(people.count / 2), bars = Gait.METHODS.anatomical.bars(Gait.fold(people, r), rad(30));
      Object.assign(out.dataset, { half: bars.half, covered: bars.covered });
      out.textContent = told.length ? `Recomputed here: ${told.join("; ")}.` : "The page has no numbers to compare with.";
      button.disabled = false;
    }
    button.addEventListener("click", check);
    if (location.hash === "#check") check();
  }
  return { start };
})();
