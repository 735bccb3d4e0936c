"use strict";
// Comparison of the numbers that the browser computes with the page's tables, which Python computed.
const Agreement = (() => {
  const JOINTS = JSON.parse(document.getElementById("joints").textContent);
  const rad = degrees => degrees * Math.PI / 180, column = (table, name) => table.header.indexOf(name);
  const keyOf = name => name === "average_walker" ? "baseline" : name;
  const methodsOf = table => [...new Set(table.rows.map(row => keyOf(row[column(table, "method")])))].filter(m => m in Gait.METHODS);
  const rest = () => new Promise(done => setTimeout(done));

  // Largest relative difference between a table and the means over walkers of `each` (fold, method, view).
  async function means(people, table, views, each, keyed, tell) {
    const sums = new Map(), methods = methodsOf(table);
    for (let r = 0; r < people.count; r++) {
      const fold = Gait.fold(people, r);
      for (const method of methods) for (const degrees of views) {
        const estimate = Gait.reconstruct(fold, method, people.components, rad(degrees), people.sigma2_mm2);
        const key = `${method} ${degrees}`, sum = sums.get(key) ?? {};
        for (const [name, value] of Object.entries(each(fold, estimate, rad(degrees), r))) sum[name] = (sum[name] ?? 0) + value / people.count;
        sums.set(key, sum);
      }
      tell((r + 1) / people.count);
      await rest();
    }
    let worst = 0, compared = 0;
    for (const row of table.rows) {
      const sum = sums.get(`${keyOf(row[column(table, "method")])} ${Number(row[column(table, "view_angle_deg")])}`);
      for (const [name, value] of sum ? keyed(row) : []) { worst = Math.max(worst, Math.abs(sum[name] / value - 1)); compared++; }
    }
    return { worst, compared, methods };
  }

  // Figure 5: errors of all walkers from all views.
  function figureFive(people, table, tell) {
    const columns = { absolute: "absolute_error_mm2", rms: "rms_error_mm", relative: "relative_error" };
    const each = (fold, { delta }, angle, r) => { const { absolute, rms, relative } = Gait.errors(people, r, delta, angle); return { absolute, rms, relative }; };
    return means(people, table, people.views_deg, each, row => Object.entries(columns).map(([name, head]) => [name, Number(row[column(table, head)])]), tell);
  }

  // Figure 4: largest difference of a reconstructed coordinate, mm.
  function figureFour(people, table) {
    const walks = new Map(), instants = new Set(table.rows.map(row => row[column(table, "instant")])).size;
    let worst = 0, compared = 0;
    for (const row of table.rows) {
      const method = row[column(table, "method")], r = people.names.indexOf(row[column(table, "walker")]), degrees = Number(row[column(table, "view_angle_deg")]);
      if (r < 0 || !(method in Gait.METHODS)) continue;
      const key = `${method} ${degrees}`;
      if (!walks.has(key)) {
        const fold = Gait.fold(people, r);
        walks.set(key, Gait.combine(fold.walker, Gait.reconstruct(fold, method, people.components, rad(degrees), people.sigma2_mm2).missing, rad(degrees)));
      }
      const q = Gait.posture(walks.get(key), Number(row[column(table, "instant")]) / instants), j = JOINTS.indexOf(row[column(table, "joint")]);
      "xyz".split("").forEach((axis, x) => { worst = Math.max(worst, Math.abs(q[3 * j + x] - Number(row[column(table, `reconstructed_${axis}_mm`)]))); compared++; });
    }
    return { worst, compared };
  }

  const percent = share => `${(100 * share).toPrecision(2)} %`;
  // Each comparison takes people and tables, reports its progress, stores its numbers and returns a sentence, or an empty
  // text without a table.  Plug-ins add their own.
  const checks = [
    async (people, tables, note, tell) => {
      const { worst, compared, methods } = await figureFive(people, tables("zhang2007_fig5", "table.csv"), tell);
      note({ worst, compared, methods: methods.join(" ") });
      return compared ? `${compared} numbers of figure 5 agree within ${percent(worst)}` : "";
    },
    async (people, tables, note) => {
      const four = tables("zhang2007_fig4", "table.csv");
      if (!four) return "";
      const { worst, compared } = figureFour(people, four);
      note({ postures: worst, coordinates: compared });
      return `${compared} coordinates of figure 4 within ${worst.toPrecision(2)} mm`;
    },
  ];

  // Button of the walker's player; its output element also has the results as data attributes.
  function start(played, tables) {
    const { people } = played;
    const button = document.getElementById("again"), out = document.getElementById("agreement");
    async function check() {
      button.disabled = true;
      const texts = [], note = numbers => Object.assign(out.dataset, numbers);
      for (const [n, compare] of checks.entries()) {
        const tell = part => { out.textContent = `${Math.round(100 * (n + part) / checks.length)} %`; };
        texts.push(await compare(people, tables, note, tell));
      }
      const began = performance.now();
      for (let i = 0; i < 100; i++) played.player.draw(i / 60, 1 / 60);
      out.dataset.drawing = ((performance.now() - began) / 100).toFixed(3);
      const sentences = texts.filter(Boolean);
      out.textContent = sentences.length ? `Recomputed here: ${sentences.join("; ")}.` : "This page has no tables to compare with.";
      button.disabled = false;
    }
    button.addEventListener("click", check);
    if (location.hash === "#check") check();
  }
  return { start, checks, means, column, percent };
})();
