"use strict";
// Start of the page: curves and pictures when they come into view, the ledger, the players.
(() => {
  const store = new Map();
  // Return a table of the page, with the columns that players read.
  const tables = (figure, name) => {
    if (!store.has(figure)) { const at = document.getElementById(`tables-${figure}`); store.set(figure, at ? JSON.parse(at.textContent) : {}); }
    const tablesOf = store.get(figure);
    if (typeof tablesOf[name] === "string") tablesOf[name] = Charts.parse(tablesOf[name]);
    return tablesOf[name] ?? null;
  };

  function drawn(box) {
    if (box.dataset.done) return;
    box.dataset.done = "yes";
    const spec = JSON.parse(box.dataset.spec), series = Charts.series(spec);
    if (Strips.wanted(spec)) Strips.draw(box, spec, series);
    else new Charts.Chart(box, { series, names: spec.names, spec, note: series.some(s => s.dots) ? "" : spec.note });
  }
  // Elements that are drawn when they come into view; their space is reserved, so that the page does not jump.
  const charts = [...document.querySelectorAll("[data-spec]")], pictures = [...document.querySelectorAll("[data-packed]")];
  async function unpacked(image) {
    const text = image.dataset.packed;
    if (!text) return;
    delete image.dataset.packed;
    const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const whole = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).blob();
    image.src = URL.createObjectURL(new Blob([whole], { type: "image/svg+xml" }));
    return image.decode().catch(() => {});
  }
  const show = at => at.dataset.spec ? drawn(at) : unpacked(at);
  const near = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { near.unobserve(entry.target); show(entry.target); }
  }, { rootMargin: "400px" });
  [...charts, ...pictures].forEach(at => near.observe(at));
  // Printing does not wait for unpacking, so pictures are unpacked one after the other while the browser is idle.
  const idle = window.requestIdleCallback ?? (task => setTimeout(task, 200)), packed = [...pictures];
  const next = () => { const image = packed.shift(); if (image) Promise.resolve(unpacked(image)).then(() => idle(next)); };
  addEventListener("load", () => idle(next));
  // A figure is drawn when it opens.
  const drawnWithin = at => at.querySelectorAll("[data-spec], [data-packed]").forEach(show);
  for (const figure of document.querySelectorAll("details.figure")) figure.addEventListener("toggle", () => { if (figure.open) drawnWithin(figure); });
  // A link to a claim or a figure opens it.
  function open(place) {
    if (place?.classList.contains("ledger-row")) Ledger.reveal(place);
    for (let up = place; up; up = up.parentElement) if (up.tagName === "DETAILS") { up.open = true; drawnWithin(up); }
  }
  document.addEventListener("click", event => {
    const link = event.target.closest('a[href^="#"]');
    if (link) open(document.getElementById(link.hash.slice(1)));
  });
  addEventListener("beforeprint", () => {
    [...charts, ...pictures].forEach(show);
    document.querySelectorAll("details.figure, details.legend-of").forEach(details => { details.open = true; });
  });

  for (const button of document.querySelectorAll("button.copy")) button.addEventListener("click", async () => {
    try { await navigator.clipboard.writeText(button.dataset.text); button.textContent = "copied"; } catch { button.textContent = "select and copy"; }
  });
  document.querySelectorAll("#story [data-spec]").forEach(drawn);  // before the first paint, so that nothing moves
  Ledger.start();
  const place = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (place) { open(place); requestAnimationFrame(() => place.scrollIntoView({ behavior: "instant" })); }
  const played = Players.start(tables);
  if (played) Agreement.start(played, tables);
})();
