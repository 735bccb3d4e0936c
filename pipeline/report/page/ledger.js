"use strict";
// The ledger as a picture: a row for each claim, one abscissa for all rows; arrow keys move through this list box.
const Ledger = (() => {
  const id = name => document.getElementById(name);
  const make = (name, className, text = "") => Object.assign(document.createElement(name), { className, textContent: text });

  function start() {
    const box = id("ledger-rows"), at = id("ledger-data");
    if (!box || !at) return;
    const { papers, claims, sets, switches } = JSON.parse(at.textContent), data = id("ledger-set"), option = id("ledger-switch");
    const home = Object.keys(sets)[0], rows = [], details = id("ledger-details");
    for (const name of Object.keys(sets)) data.add(new Option(name, name));
    data.parentElement.hidden = Object.keys(sets).length < 2;
    option.add(new Option("none: the defaults", ""));
    switches.forEach((entry, i) => option.add(new Option(`${entry.name} (${entry.verdicts})`, i)));
    option.parentElement.hidden = !switches.length;

    for (const [paper, words] of papers) {
      const group = box.appendChild(make("div", "ledger-paper")), claimsOfPaper = claims.filter(claim => claim.paper === paper);
      group.setAttribute("role", "group"); group.setAttribute("aria-label", words);
      const head = group.appendChild(make("div", "ledger-head", words));
      head.setAttribute("aria-hidden", "true");
      head.append(make("span", "", `${claimsOfPaper.filter(c => c.kind !== "condition" && c.kind !== "target").length ? "disagrees · bound · agrees" : "missed · bound · reached"}`));
      for (const claim of claimsOfPaper) {
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
    // Open the figure of a claim and scroll to the claim.
    function go(claim) {
      const place = id(`claim-${claim.name}`) ?? id(claim.figure);
      if (!place) return;
      for (let up = place; up; up = up.parentElement) if (up.tagName === "DETAILS") up.open = true;
      history.pushState(null, "", `#${place.id}`);
      place.scrollIntoView({ block: "center", behavior: "instant" });
      place.tabIndex = -1; place.focus({ preventScroll: true });
    }
    const moved = () => option.value === "" ? {} : switches[option.value].moved;
    const resultOf = claim => ({ ...sets[data.value || home][claim.name], ...moved()[claim.name] });
    function tell(claim) {
      const f = resultOf(claim), unit = claim.unit ? ` ${claim.unit}` : "", all = [], digits = v => Charts.within(v, f.ends);
      const add = (name, ...parts) => { const p = make("p", name); p.append(...parts); all.push(p); return p; };
      const chip = (tone, words) => make("span", `chip ${tone}`, words), link = make("a", "", `${claim.figure}, section ${claim.section || "–"}`);
      link.href = `#claim-${claim.name}`;
      link.addEventListener("click", event => { event.preventDefault(); go(claim); });
      const target = claim.kind === "target";
      add("ledger-says", make("b", "", claim.short), target ? `: ${claim.quote} ` : `: “${claim.quote}” `, link);
      if (f.verdict) {
        const line = add("", chip(f.tone, f.verdict));
        if (f.beyond) line.append(chip({ yes: "better", no: "even", worse: "worse", unknown: "unsure" }[f.beyond] ?? "even", { yes: "beyond its baseline", no: "not beyond its baseline", worse: "worse than its baseline", unknown: "comparison with its baseline unknown" }[f.beyond] ?? f.beyond));
        line.append(`ours ${digits(f.value)}${unit}`, f.ends ? ` (95 %: ${digits(f.ends[0])} to ${digits(f.ends[1])})` : "",
          Number.isFinite(claim.published) ? `; ${target ? "target" : "the paper"} ${Charts.say(claim.published)}${unit}` : "", claim.bounds ? `; bounds ${claim.bounds.replaceAll("-", "−")}` : "",
          f.simple !== undefined && claim.baseline ? `; baseline ${Charts.say(f.simple)}${unit}: ${claim.baseline}` : "");
      } else add("", chip("none", "no number"), `in this data set${claim.bounds ? `; bounds ${claim.bounds.replaceAll("-", "−")}` : ""}`);
      if (claim.why) add("meta", `Reason for the bounds, and meaning: ${claim.why}.`.replace(/\.\.$/, "."));
      if (claim.help) add("meta", `Information that the paper's method did not have: ${claim.help}.`);
      if (claim.same_as) add("meta", `The same number as ${claim.same_as}, where it is counted.`);
      details.replaceChildren(...all);
    }
    function place() {
      const jumps = moved();
      let shown = 0;
      for (const { claim, row, parts } of rows) {
        const f = resultOf(claim), placed = f.at !== undefined;
        row.classList.toggle("empty", !placed);
        row.classList.toggle("jumps", Boolean(jumps[claim.name]?.jumps));
        row.setAttribute("aria-label", `${claim.short}: ${f.verdict ?? "no number"}`);
        if (!placed) continue;
        shown++;
        parts.dot.className = `ledger-dot ${f.tone}`; parts.dot.style.left = `${f.at}%`;
        parts.reach.hidden = !f.reach; parts.ring.hidden = f.ring === undefined;
        if (f.reach) { parts.reach.style.left = `${f.reach[0]}%`; parts.reach.style.width = `${Math.max(f.reach[1] - f.reach[0], 0)}%`; }
        if (f.ring !== undefined) parts.ring.style.left = `${f.ring}%`;
      }
      const active = switches[option.value];
      id("ledger-state").textContent = active ? `With ${active.options || active.name}, ${Object.keys(active.moved).length} of ${shown} claims change; ${active.verdicts} get another verdict (marked).`
        : `${shown} of ${rows.length} claims have a number for ${data.value || home}.`;
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
