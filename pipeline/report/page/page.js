"use strict";
// Curves and tables on demand, players.
(() => {
  const store = new Map();
  // A table of the page, of large ones the first rows; `curves` of these have all rows of the columns that are drawn.
  const tables = (figure, name, kind = "tables") => {
    const key = `${kind}-${figure}/${name}`;
    if (!store.has(key)) {
      const at = document.getElementById(`${kind}-${figure}`), text = at ? JSON.parse(at.textContent)[name] : undefined;
      store.set(key, text === undefined ? null : Charts.parse(text));
    }
    return store.get(key);
  };
  const curves = (figure, name) => tables(figure, name, "curves") ?? tables(figure, name);

  function drawn(box) {
    if (box.dataset.done) return;
    box.dataset.done = "yes";
    const spec = JSON.parse(box.dataset.spec), of = name => curves(box.dataset.figure, name), made = Charts.series(spec, of);
    if (made.series.length) new Charts.Chart(box, { ...made, spec, note: made.series.some(s => s.dots) ? "" : Charts.bandWords(spec, of) });
  }
  const boxes = [...document.querySelectorAll("[data-spec]")];
  const near = new IntersectionObserver(entries => {
    for (const entry of entries) if (entry.isIntersecting) { drawn(entry.target); near.unobserve(entry.target); }
  }, { rootMargin: "600px" });
  boxes.forEach(box => near.observe(box));
  // Curves take room: all are drawn before somebody goes to a place on the page, so that it stays where it is.
  document.addEventListener("click", event => { if (event.target.closest('a[href^="#"]')) boxes.forEach(drawn); });
  const idle = window.requestIdleCallback ?? (work => setTimeout(work, 50)), later = [...boxes];
  const next = () => { const box = later.shift(); if (box) { drawn(box); idle(next); } };
  idle(next);
  const place = document.getElementById(location.hash.slice(1));
  if (place) { boxes.forEach(drawn); requestAnimationFrame(() => place.scrollIntoView({ behavior: "instant" })); }
  addEventListener("beforeprint", () => {
    boxes.forEach(drawn);
    document.querySelectorAll("details:not([data-name])").forEach(details => { details.open = true; });
  });

  const SHOWN = 100;
  function fill(details) {
    if (details.dataset.done) return;
    details.dataset.done = "yes";
    const { figure, name } = details.dataset, table = tables(figure, name), box = details.querySelector(".table");
    if (!table) return;
    const numeric = table.header.map((_, c) => table.rows.every(row => row[c] === "" || !Number.isNaN(Number(row[c]))));
    let order = -1, down = false, all = false;
    const element = box.appendChild(document.createElement("table")), more = box.parentElement.querySelector(".more");
    const caption = element.createCaption();
    caption.textContent = `${figure}/${name}`;
    const head = element.createTHead().insertRow(), body = element.createTBody();
    table.header.forEach((title, c) => {
      const th = head.appendChild(document.createElement("th")), button = th.appendChild(document.createElement("button"));
      th.scope = "col"; button.type = "button"; button.textContent = title;
      button.addEventListener("click", () => { down = order === c ? !down : false; order = c; render(); });
    });
    function render() {
      const rows = [...table.rows];
      if (order >= 0) {
        const sign = down ? -1 : 1;
        rows.sort((a, b) => sign * (numeric[order] ? (Charts.number(a[order]) || 0) - (Charts.number(b[order]) || 0) : a[order].localeCompare(b[order])));
      }
      [...head.cells].forEach((th, c) => th.setAttribute("aria-sort", c !== order ? "none" : down ? "descending" : "ascending"));
      body.replaceChildren(...rows.slice(0, all ? Infinity : SHOWN).map(row => {
        const tr = document.createElement("tr");
        row.forEach((cell, c) => { const td = tr.insertCell(); td.textContent = cell; if (numeric[c]) td.className = "n"; });
        return tr;
      }));
      more.hidden = all || rows.length <= SHOWN;
    }
    more.addEventListener("click", () => { all = true; render(); });
    render();
  }
  for (const details of document.querySelectorAll("details[data-name]")) {
    details.addEventListener("toggle", () => { if (details.open) fill(details); });
    const button = details.querySelector(".download");
    if (button) button.addEventListener("click", () => {
      const { figure, name } = details.dataset, text = JSON.parse(document.getElementById(`tables-${figure}`).textContent)[name];
      const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(new Blob([text], { type: "text/csv" })), download: `${figure}-${name}` });
      link.click(); setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }
  for (const button of document.querySelectorAll("button.copy")) button.addEventListener("click", async () => {
    try { await navigator.clipboard.writeText(button.dataset.text); button.textContent = "copied"; } catch { button.textContent = "select and copy"; }
  });
  const played = Players.start(curves);
  if (played) Agreement.start(played, curves);
})();
