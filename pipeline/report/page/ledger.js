"use strict";
// The ledger as a picture: a row to each claim, one abscissa for all; a listbox, so that arrow keys walk through it.
const Ledger = (() => {
  const id = name => document.getElementById(name);
  const make = (name, className, text = "") => Object.assign(document.createElement(name), { className, textContent: text });

  function start() {
    const box = id("ledger-rows"), at = id("ledger-data");
    if (!box || !at) return;
    const { papers, claims, sets, switches } = JSON.parse(at.textContent), data = id("ledger-set"), option = id("ledger-switch");
    const home = Object.keys(sets)[0], rows = [], said = id("ledger-said");
    for (const name of Object.keys(sets)) data.add(new Option(name, name));
    data.parentElement.hidden = Object.keys(sets).length < 2;
    option.add(new Option("as it is", ""));
    switches.forEach((one, i) => option.add(new Option(`${one.name} (${one.verdicts})`, i)));
    option.parentElement.hidden = !switches.length;

    for (const [paper, words] of papers) {
      const group = box.appendChild(make("div", "ledger-paper")), of = claims.filter(claim => claim.paper === paper);
      group.setAttribute("role", "group"); group.setAttribute("aria-label", words);
      const head = group.appendChild(make("div", "ledger-head", words));
      head.setAttribute("aria-hidden", "true");
      head.append(make("span", "", `${of.filter(c => c.kind !== "condition" && c.kind !== "target").length ? "against · the bound · as the paper says" : "against · the bound · as intended"}`));
      for (const claim of of) {
        const row = group.appendChild(make("div", "ledger-row")), plot = make("span", "ledger-plot"), parts = {};
        row.id = `row-${claim.name}`; row.setAttribute("role", "option"); row.setAttribute("aria-selected", "false");
        row.append(make("span", "ledger-quote", claim.short), plot);
        for (const name of ["reach", "ring", "dot"]) parts[name] = plot.appendChild(make("i", `ledger-${name}`));
        if (claim.kind === "condition") row.classList.add("condition");
        rows.push({ claim, row, parts });
        row.addEventListener("pointerenter", event => { if (event.pointerType === "mouse") choose(rows.findIndex(r => r.row === row)); });
        row.addEventListener("click", () => { const last = row.classList.contains("aimed"); choose(rows.findIndex(r => r.row === row)); if (last || matchMedia("(hover: hover)").matches) go(claim); row.classList.add("aimed"); });
      }
    }
    let now = -1;
    function choose(i, scroll = false) {
      if (i < 0 || i >= rows.length || i === now) return;
      rows[now]?.row.classList.remove("chosen", "aimed"); rows[now]?.row.setAttribute("aria-selected", "false");
      now = i;
      const { row, claim } = rows[i];
      row.classList.add("chosen"); row.setAttribute("aria-selected", "true");
      box.setAttribute("aria-activedescendant", row.id);
      if (scroll) row.scrollIntoView({ block: "nearest", behavior: "instant" });
      tell(claim);
    }
    // The figure of a claim, opened at it.
    function go(claim) {
      const place = id(`claim-${claim.name}`) ?? id(claim.figure);
      if (!place) return;
      for (let up = place; up; up = up.parentElement) if (up.tagName === "DETAILS") up.open = true;
      history.pushState(null, "", `#${place.id}`);
      place.scrollIntoView({ block: "center", behavior: "instant" });
      place.tabIndex = -1; place.focus({ preventScroll: true });
    }
    const moved = () => option.value === "" ? {} : switches[option.value].moved;
    const found = claim => ({ ...sets[data.value || home][claim.name], ...moved()[claim.name] });
    function tell(claim) {
      const f = found(claim), unit = claim.unit ? ` ${claim.unit}` : "", all = [], digits = v => Charts.within(v, f.ends);
      const add = (name, ...parts) => { const p = make("p", name); p.append(...parts); all.push(p); return p; };
      const chip = (tone, words) => make("span", `chip ${tone}`, words), link = make("a", "", `${claim.figure}, section ${claim.section || "–"}`);
      link.href = `#claim-${claim.name}`;
      link.addEventListener("click", event => { event.preventDefault(); go(claim); });
      const target = claim.kind === "target";
      add("ledger-says", make("b", "", claim.short), target ? `: ${claim.quote} ` : `: “${claim.quote}” `, link);
      if (f.said) {
        const line = add("", chip(f.tone, f.said));
        if (f.beyond) line.append(chip({ yes: "better", no: "even", worse: "worse", unknown: "unsure" }[f.beyond] ?? "even", { yes: "beyond its baseline", no: "not beyond its baseline", worse: "worse than its baseline", unknown: "whether beyond its baseline is not known" }[f.beyond] ?? f.beyond));
        line.append(`ours ${digits(f.value)}${unit}`, f.ends ? ` (95 %: ${digits(f.ends[0])} to ${digits(f.ends[1])})` : "",
          Number.isFinite(claim.published) ? `; ${target ? "target" : "the paper"} ${Charts.say(claim.published)}${unit}` : "", claim.bounds ? `; bounds ${claim.bounds.replaceAll("-", "−")}` : "",
          f.simple !== undefined && claim.baseline ? `; baseline ${Charts.say(f.simple)}${unit}: ${claim.baseline}` : "");
      } else add("", chip("none", "no number"), `here${claim.bounds ? `; bounds ${claim.bounds.replaceAll("-", "−")}` : ""}`);
      if (claim.why) add("meta", `Why these bounds, and what it means: ${claim.why}.`.replace(/\.\.$/, "."));
      if (claim.help) add("meta", `Help that the paper's method did not have: ${claim.help}.`);
      if (claim.same_as) add("meta", `The same number as ${claim.same_as}, counted there.`);
      said.replaceChildren(...all);
    }
    function place() {
      const jumps = moved();
      let shown = 0;
      for (const { claim, row, parts } of rows) {
        const f = found(claim), there = f.at !== undefined;
        row.classList.toggle("empty", !there);
        row.classList.toggle("jumps", Boolean(jumps[claim.name]?.jumps));
        row.setAttribute("aria-label", `${claim.short}: ${f.said ?? "no number"}`);
        if (!there) continue;
        shown++;
        parts.dot.className = `ledger-dot ${f.tone}`; parts.dot.style.left = `${f.at}%`;
        parts.reach.hidden = !f.reach; parts.ring.hidden = f.ring === undefined;
        if (f.reach) { parts.reach.style.left = `${f.reach[0]}%`; parts.reach.style.width = `${Math.max(f.reach[1] - f.reach[0], 0)}%`; }
        if (f.ring !== undefined) parts.ring.style.left = `${f.ring}%`;
      }
      const one = switches[option.value];
      id("ledger-state").textContent = one ? `With ${one.options || one.name}: ${Object.keys(one.moved).length} of ${shown} claims move, ${one.verdicts} to another verdict (marked).`
        : `${shown} of ${rows.length} claims have a number on ${data.value || home}.`;
      if (now >= 0) tell(rows[now].claim);
    }
    box.addEventListener("keydown", event => {
      const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1, PageDown: 10, PageUp: -10, Home: -rows.length, End: rows.length }[event.key];
      if (step) { choose(Math.max(0, Math.min(rows.length - 1, now + step)), true); event.preventDefault(); }
      else if (event.key === "Enter" && now >= 0) { go(rows[now].claim); event.preventDefault(); }
    });
    data.addEventListener("input", () => { option.value = ""; option.disabled = data.value !== home; place(); });
    option.addEventListener("input", place);
    place();
    choose(Math.max(0, rows.findIndex(r => r.claim.name === box.dataset.first)));
  }
  return { start };
})();
