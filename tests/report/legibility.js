// Faults of every picture and chart of a page: texts over one another or cut, ends outside the axes, missing bands.
addEventListener("load", async () => {
  await document.fonts.ready;
  for (const box of document.querySelectorAll("[data-spec]")) {
    const spec = JSON.parse(box.dataset.spec);
    new Charts.Chart(box, { series: Charts.series(spec), names: spec.names, spec, note: spec.note });
  }
  /* more */
  const TOUCH = 1.5;
  for (const box of document.querySelectorAll("[data-name]")) {
    const svg = box.querySelector("svg"), frame = svg.getBoundingClientRect();
    const fault = words => faults.push(`${box.dataset.name}: ${words}`);
    const texts = [...svg.querySelectorAll("text")].filter(at => at.textContent.trim()).map(at => [at.textContent.trim(), at.getBoundingClientRect()]);
    if (!texts.length) fault("no text");
    texts.forEach(([words, a], i) => {
      if (a.left < frame.left - TOUCH || a.right > frame.right + TOUCH || a.top < frame.top - TOUCH || a.bottom > frame.bottom + TOUCH) fault(`"${words}" is cut`);
      for (const [other, b] of texts.slice(i + 1)) {
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left), high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (wide > TOUCH && high > 0.25 * Math.min(a.height, b.height)) fault(`"${words}" over "${other}"`);
      }
      if (/(^|[\s(])-\d/.test(words)) fault(`"${words}" has a hyphen for a minus`);
    });
    const spec = box.dataset.spec && JSON.parse(box.dataset.spec);
    if (spec) {
      const [low, high] = spec.limits, slack = 1e-5 * Math.max(Math.abs(low), Math.abs(high));
      for (const s of spec.series) {
        const ends = [...(s.lo ?? []), ...(s.hi ?? []), ...s.y].filter(v => v !== null && !(spec.log_y && v < (spec.least ?? 0)));
        const outside = ends.filter(v => v < low - slack || v > high + slack);
        if (outside.length) fault(`${outside.length} ends of ${s.key} outside the axis`);
      }
      const expected = spec.names || spec.series.some(s => s.line === "points") ? null
        : spec.series.flatMap(s => [["lo", "interval"], ["low", "band"]].filter(([end]) => (s[end] ?? []).filter(v => v !== null).length > 1)).length;
      const drawn = svg.querySelectorAll("polygon").length;
      if (expected !== null && drawn !== expected) fault(`${drawn} of ${expected} bands`);
    } else {
      const counted = { band: 0, interval: 0 };
      for (const group of svg.querySelectorAll("g[id^=axes_]")) {
        const axes = group.querySelector("g[id^=patch_] path")?.getBoundingClientRect();
        if (!axes) continue;  // stick figures
        for (const kind of Object.keys(counted)) for (const marks of group.querySelectorAll(`g[id^=${kind}-]`)) {
          counted[kind]++;
          const at = marks.getBoundingClientRect();
          if (kind === "interval" && (at.top < axes.top - TOUCH || at.bottom > axes.bottom + TOUCH || at.left < axes.left - 4 || at.right > axes.right + 4)) fault("an interval ends outside the axes");
        }
      }
      for (const [kind, least] of Object.entries(JSON.parse(box.dataset.least))) if (counted[kind] < least) fault(`${counted[kind]} of ${least} ${kind}s`);
    }
  }
  document.body.replaceChildren(Object.assign(document.createElement("pre"), { id: "faults", textContent: JSON.stringify({ looked: document.body.dataset.count, faults }) }));
});
