"use strict";
// The ledger: a row for each claim, one abscissa for all rows.  A row opens in place; filters choose the rows.
const Ledger = (() => {
  const JUDGED = ["agrees", "close", "undecided", "differs"], HEAD_ROWS = 1.7;
  const id = name => document.getElementById(name);
  const make = (name, className, text = "") => Object.assign(document.createElement(name), { className, textContent: text });
  const measured = unit => !unit ? "" : /^(°|degrees?)$/.test(unit) ? "°" : ` ${unit}`;
  let reveal = () => {};

  function start() {
    const box = id("ledger-rows"), at = id("ledger-data");
    if (!box || !at) return;
    const { claims, sets, switches } = JSON.parse(at.textContent), named = new Map(claims.map(claim => [`claim-${claim.name}`, claim]));
    const [data, verdict, of, option] = ["ledger-set", "ledger-verdict", "ledger-of", "ledger-switch"].map(id), home = data.value;
    const heads = [...box.querySelectorAll(".ledger-head")], wide = matchMedia("(min-width: 801px)");
    const rows = [...box.querySelectorAll(".ledger-row")].map(row => {
      const parts = Object.fromEntries(["name", "reach", "ring", "dot", "value", "more"].map(name => [name, row.querySelector(`.ledger-${name}`)]));
      return { row, parts, claim: named.get(row.id), said: parts.name.appendChild(make("span", "skip")) };
    });
    data.parentElement.hidden = data.options.length < 2;
    const active = () => option?.value ? switches[option.value] : null;
    const resultOf = claim => ({ ...sets[data.value][claim.name], ...active()?.moved[claim.name] });

    function tell({ claim, parts }) {
      const f = resultOf(claim), unit = measured(claim.unit), all = [], digits = v => Charts.within(v, f.ends), target = claim.kind === "target";
      const range = ends => `${Charts.within(ends[0], ends)} to ${Charts.within(ends[1], ends)}`;
      const add = (name, ...words) => { const p = make("p", name); p.append(...words.filter(Boolean)); all.push(p); };
      const link = make("a", "", claim.figure);
      link.href = `#${claim.figure}`;
      add("", target ? `${claim.quote} (` : `“${claim.quote}” (`, target ? "" : `section ${claim.section || "–"}, `, link, ")");
      const numbers = f.value === undefined ? ["no number in this data set"] : [`ours ${digits(f.value)}${unit}`, f.ends ? ` (95 %: ${range(f.ends)})` : "",
        Number.isFinite(claim.published) ? `; ${target ? "target" : "the paper"} ${Charts.say(claim.published)}${unit}` : ""];
      add("", make("span", `chip ${f.tone ?? "none"}`, f.verdict ?? "not in this data set"), ...numbers, claim.bounds ? `; bounds ${claim.bounds.replaceAll("-", "−")}` : "");
      if (f.simple !== undefined && claim.baseline) add("", f.beyond ? make("span", `chip ${{ yes: "better", no: "even", worse: "worse" }[f.beyond] ?? "unsure"}`, { yes: "beyond its baseline", no: "not beyond its baseline", worse: "worse than its baseline" }[f.beyond] ?? "gap to its baseline unknown") : "",
        `baseline ${Charts.say(f.simple)}${unit}: ${claim.baseline}${claim.baseline_knows ? `; it knows ${claim.baseline_knows}` : ""}`, f.gain ? `; gain ${range(f.gain)}` : "");
      if (claim.why) add("meta", `Reason for the bounds, and meaning: ${claim.why}.`.replace(/\.\.$/, "."));
      if (f.possible) add("meta", `One sample of the paper's size can give the paper's number: ${f.possible}${f.one_sample ? ` (95 % of samples: ${range(f.one_sample)})` : ""}.`);
      if (claim.help) add("meta", `Information that the paper's method did not have: ${claim.help}.`);
      if (claim.same_as) add("meta", `The same number as ${claim.same_as}, where it is counted.`);
      parts.more.replaceChildren(...all);
    }
    // Positions and verdicts of all rows; rows that the filters choose, in two columns that stay as they are when one opens.
    function place() {
      let numbered = 0;
      for (const entry of rows) {
        const { claim, row, parts, said } = entry, f = resultOf(claim), placed = f.at !== undefined;
        row.hidden = Boolean((of.value && of.value !== claim.paper) || (verdict.value === "judged" ? !JUDGED.includes(f.verdict) : verdict.value && verdict.value !== f.verdict));
        row.classList.toggle("jumps", Boolean(active()?.moved[claim.name]?.jumps));
        said.textContent = `: ${f.verdict ?? "not in this data set"}, `;
        parts.value.textContent = f.value === undefined ? "–" : `${Charts.within(f.value, f.ends)}${measured(claim.unit)}`;
        numbered += f.value !== undefined;
        parts.dot.className = `ledger-dot ${f.tone ?? "none"}`;
        parts.dot.hidden = !placed; parts.reach.hidden = !placed || !f.reach; parts.ring.hidden = !placed || f.ring === undefined;
        if (placed) parts.dot.style.left = `${f.at}%`;
        if (f.reach) { parts.reach.style.left = `${f.reach[0]}%`; parts.reach.style.width = `${Math.max(f.reach[1] - f.reach[0], 0)}%`; }
        if (f.ring !== undefined) parts.ring.style.left = `${f.ring}%`;
        if (row.open) tell(entry);
      }
      const shown = rows.filter(({ row }) => !row.hidden), columns = [make("div", "ledger-column"), make("div", "ledger-column")];
      const half = wide.matches ? (shown.length + HEAD_ROWS * (new Set(shown.map(({ claim }) => claim.paper)).size + 0.5)) / 2 : Infinity;
      let filled = 0;
      for (const head of heads) {
        const group = rows.filter(({ claim }) => claim.paper === head.dataset.paper);
        head.hidden = group.every(({ row }) => row.hidden);
        let column = columns[filled < half - 2 ? 0 : 1];
        column.append(head);
        filled += head.hidden ? 0 : HEAD_ROWS;
        for (const { row } of group) {
          if (!row.hidden && column === columns[0] && filled >= half) {
            column = columns[1];
            column.append(make("p", "ledger-head", `${head.textContent}, continued`));
            filled += HEAD_ROWS;
          }
          column.append(row);
          filled += !row.hidden;
        }
      }
      box.replaceChildren(...columns);
      const change = active();
      id("ledger-state").textContent = change ? `With ${change.options || change.name}, ${Object.keys(change.moved).length} of ${numbered} claims change; ${change.verdicts} get another verdict (marked).`
        : `${shown.length} of ${rows.length} claims`;
    }
    for (const entry of rows) entry.row.addEventListener("toggle", () => { if (entry.row.open) tell(entry); });
    box.addEventListener("keydown", event => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key], all = [...box.querySelectorAll(".ledger-row:not([hidden]) > summary")], now = all.indexOf(document.activeElement);
      if (step && now >= 0) { all[Math.max(0, Math.min(all.length - 1, now + step))].focus(); event.preventDefault(); }
    });
    data.addEventListener("input", () => { if (option) { option.value = ""; option.disabled = data.value !== home; } place(); });
    for (const control of [verdict, of, option].filter(Boolean)) control.addEventListener("input", place);
    wide.addEventListener("change", place);
    reveal = row => { if (row.hidden) { verdict.value = of.value = ""; place(); } row.open = true; };
    place();
  }
  return { start, reveal: row => reveal(row) };
})();
