"use strict";
// Errors of joint angles in zhang2007_joint_angles, recomputed in the browser.
const JointAngles = (() => {
  const JOINTS = JSON.parse(document.getElementById("joints").textContent), INSTANTS = 40;
  const { column, means, percent } = Agreement;

  // Angles (radians; left, right) of hips, knees, shoulders and elbows, like walk3d/anatomy/joint_angles.
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
  function errors(people, table, tell) {
    const views = [...new Set(table.rows.map(row => Number(row[column(table, "view_angle_deg")])))], trueAngles = new Map();
    const each = (fold, { missing }, angle, r) => {
      if (!trueAngles.has(r)) trueAngles.set(r, cycle(fold.walker));
      const real = trueAngles.get(r), angles = cycle(Gait.combine(fold.walker, missing, angle)), out = {};
      for (const name of Object.keys(real[0])) {
        const squares = [0, 0];
        angles.forEach((at, t) => at[name].forEach((v, side) => {
          const off = Math.atan2(Math.sin(v - real[t][name][side]), Math.cos(v - real[t][name][side]));
          squares[side] += off * off / INSTANTS;
        }));
        out[name] = (Math.sqrt(squares[0]) + Math.sqrt(squares[1])) / 2 * 180 / Math.PI;
      }
      return out;
    };
    return means(people, table, views, each, row => [[row[column(table, "angle")], Number(row[column(table, "rmse_deg")])]], tell);
  }

  Agreement.checks.push(async (people, tables, note, tell) => {
    const table = tables("zhang2007_joint_angles", "table.csv");
    if (!table) return "";
    const { worst, compared, methods } = await errors(people, table, tell);
    note({ angles: worst, angled: compared });
    return compared ? `${compared} errors of joint angles${methods.includes("anatomical") ? ", including the anatomical method," : ""} within ${percent(worst)}` : "";
  });
  return { flexion };
})();
