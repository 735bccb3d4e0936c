"use strict";
// Curves as SVG, with a slider below each that reads off the values: by mouse, finger or keyboard.
const Charts = (() => {
  const SVG = "http://www.w3.org/2000/svg", W = 640, H = 300, LEFT = 62, RIGHT = 14, TOP = 12, BOTTOM = 44;
  const CYCLE = ["black", "orange", "blue", "green", "purple", "amber", "sky", "grey"];
  const DASHES = ["", "7 4", "2 3", "9 3 2 3"];
  const ROLES = JSON.parse(document.getElementById("roles").textContent);

  function parse(text) {
    const lines = text.split("\n").filter(line => line), rows = lines.map(cells), header = rows.shift() ?? [];
    return { header, rows };
  }
  function cells(line) {
    if (!line.includes('"')) return line.split(",");
    const out = []; let cell = "", quoted = false;
    for (let i = 0; i < line.length; i++) {
      const c = line[i];
      if (quoted) { if (c === '"' && line[i + 1] === '"') { cell += c; i++; } else if (c === '"') quoted = false; else cell += c; }
      else if (c === '"') quoted = true; else if (c === ",") { out.push(cell); cell = ""; } else cell += c;
    }
    out.push(cell);
    return out;
  }
  const number = text => text === "" || text === undefined ? NaN : Number(text);
  const say = v => !Number.isFinite(v) ? "–" : v === 0 ? "0" : Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3 ? v.toExponential(1)
    : Number(v.toPrecision(4)).toLocaleString("en", { maximumFractionDigits: 6 }).replace("-", "−");
  const words = name => String(name).replace(/\bmap\b/, "MAP").replaceAll("_", " ");

  // Series of a table, as conf/report.yaml describes them.
  function series(spec, table) {
    const column = name => table.header.indexOf(name), x = column(spec.x), by = (spec.by ?? []).map(column);
    const where = Object.entries(spec.where ?? {}).map(([name, value]) => [column(name), [value].flat().map(String)]);
    const rows = table.rows.filter(row => where.every(([c, values]) => values.includes(row[c])));
    const categorical = rows.some(row => row[x] !== "" && Number.isNaN(Number(row[x])));
    const names = categorical ? [...new Set(rows.map(row => row[x]))] : null;
    const found = new Map();
    for (const y of [spec.y].flat()) {
      const band = bandOf(spec, table.header, y).map(column);
      for (const row of rows) {
        const parts = [...([spec.y].flat().length > 1 ? [y] : []), ...by.map(c => row[c])];
        const key = parts.filter(p => p !== "").map(p => spec.names?.[p] ?? p).join(" · ") || spec.y_label;
        if (!found.has(key)) found.set(key, { name: words(key), parts, points: [] });
        const value = number(row[column(y)]);
        const [lo, hi] = band.length === 2 ? band.map(c => number(row[c]))
          : band.length === 1 ? [value - number(row[band[0]]), value + number(row[band[0]])] : [NaN, NaN];
        const at = names ? names.indexOf(row[x]) : number(row[x]);
        if (Number.isFinite(value) && Number.isFinite(at)) found.get(key).points.push({ x: at, y: value, lo, hi });
      }
    }
    const all = [...found.values()].filter(s => s.points.length);
    const groups = [...new Set(all.map(s => s.parts.slice(0, -1).join()))];
    const lasts = [...new Set(all.map(s => s.parts.at(-1)))];
    all.forEach((s, i) => {
      s.points.sort((a, b) => a.x - b.x);
      const role = s.parts.map(p => ROLES[p] ?? ROLES[String(p).replace(/^rms_error_|_mm$/g, "")]).find(Boolean);
      const two = s.parts.length > 1 && groups.length > 1 && lasts.length > 1;
      s.colour ??= role ?? CYCLE[(two ? groups.indexOf(s.parts.slice(0, -1).join()) : i) % CYCLE.length];
      s.dash ??= two ? DASHES[lasts.indexOf(s.parts.at(-1)) % DASHES.length] : "";
    });
    return { series: all, names };
  }
  function bandOf(spec, header, y) {
    if (spec.band) return [spec.band].flat();
    const ends = ["low", "high"].map(end => header.find(name => name !== y && name.replace(`_${end}`, "") === y));
    if (ends.every(Boolean)) return ends;
    const spread = ["sd", "se"].map(end => header.find(name => name.replace(`_${end}`, "") === y && name !== y)).find(Boolean);
    return spread ? [spread] : [];
  }
  function bandWords(spec, header) {
    const band = [spec.y].flat().length > 1 ? [] : bandOf(spec, header, [spec.y].flat()[0]);
    return !band.length ? "" : band.length === 2 ? "bands: 95 % interval" : band[0].includes("_se") ? "bands: ±1 standard error"
      : "bands: ±1 standard deviation";
  }

  function ticks(low, high, log) {
    if (log) {
      const out = [];
      for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++)
        for (const m of high / low > 300 ? [1] : [1, 2, 5]) { const v = m * 10 ** e; if (v >= low * 0.999 && v <= high * 1.001) out.push(v); }
      return out;
    }
    const raw = (high - low || 1) / 6, power = 10 ** Math.floor(Math.log10(raw));
    const degrees = high - low >= 120 && high <= 180 && low >= -180;
    const step = degrees && raw > 20 ? 30 : power * [1, 2, 5, 10].find(m => m * power >= raw), out = [];
    for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-9; v += step) out.push(Math.abs(v) < step * 1e-9 ? 0 : v);
    return out;
  }

  class Chart {
    constructor(box, { series, names = null, spec, note = "" }) {
      Object.assign(this, { box, series, names, spec, note, onmove: null });
      box.replaceChildren();
      box.classList.add("chart");
      this.svg = box.appendChild(document.createElementNS(SVG, "svg"));
      this.svg.setAttribute("viewBox", `0 0 ${W} ${H}`);
      this.svg.setAttribute("role", "img");
      this.svg.setAttribute("aria-label", `${spec.y_label} against ${spec.x_label}`);
      this.legend = box.appendChild(document.createElement("p"));
      this.legend.className = "legend";
      this.xs = [...new Set(series.flatMap(s => s.points.map(p => p.x)))].sort((a, b) => a - b);
      this.slider = box.appendChild(Object.assign(document.createElement("input"), { type: "range", min: 0,
        max: Math.max(this.xs.length - 1, 0), step: 1 }));
      this.slider.value = spec.start ?? Math.floor(this.xs.length / 2);
      this.slider.setAttribute("aria-label", `read off the values at a ${spec.x_label}`);
      this.output = box.appendChild(document.createElement("output"));
      this.slider.addEventListener("input", () => this.moved());
      const follow = event => {
        const at = this.svg.getBoundingClientRect(), px = (event.clientX - at.left) / at.width * W;
        let best = 0;
        this.xs.forEach((x, i) => { if (Math.abs(this.px(x) - px) < Math.abs(this.px(this.xs[best]) - px)) best = i; });
        this.slider.value = best; this.moved();
      };
      this.svg.addEventListener("pointermove", event => { if (event.pointerType === "mouse" || event.buttons) follow(event); });
      this.svg.addEventListener("pointerdown", follow);
      this.draw();
      this.moved(false);
    }
    scales() {
      const points = this.series.flatMap(s => s.points), { log_x, log_y, zero } = this.spec;
      const xs = points.map(p => p.x).filter(x => !log_x || x > 0);
      let ys = points.map(p => p.y).filter(y => !log_y || y > 0);
      const top = Math.max(...ys), least = Math.min(...ys);
      if (!log_y) ys = ys.concat(points.flatMap(p => [p.lo, p.hi]).filter(v => Number.isFinite(v) && v < top + (top - least || top) && v > least - (top - least)));
      let [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
      if (this.names) { x0 -= 0.5; x1 += 0.5; }
      if (zero && !log_y) y0 = Math.min(0, this.series.some(s => s.points.some(p => p.y < 0)) ? y0 : 0);
      if (log_y) { y0 = Math.max(y0, this.spec.least ?? y1 * 1e-6); y0 /= 1.2; y1 *= 1.2; } else { const pad = (y1 - y0 || 1) * 0.04; y1 += pad; if (!zero) y0 -= pad; }
      if (x0 === x1) { x0 -= 1; x1 += 1; }
      const map = (v, a, b, log) => log ? Math.log(Math.max(v, a) / a) / Math.log(b / a) : (v - a) / (b - a);
      this.px = x => LEFT + (W - LEFT - RIGHT) * map(x, x0, x1, log_x);
      this.py = y => H - BOTTOM - (H - TOP - BOTTOM) * Math.max(-0.02, Math.min(1.02, map(y, y0, y1, log_y)));
      return { x: ticks(x0, x1, log_x), y: ticks(y0, y1, log_y) };
    }
    node(name, attributes, parent = this.svg) {
      const made = parent.appendChild(document.createElementNS(SVG, name));
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      return made;
    }
    text(x, y, words, attributes) { this.node("text", { x, y, ...attributes }).textContent = words; }
    draw() {
      this.svg.replaceChildren();
      const marks = this.scales(), bottom = H - BOTTOM;
      for (const y of marks.y) {
        this.node("line", { x1: LEFT, x2: W - RIGHT, y1: this.py(y), y2: this.py(y), class: "grid" });
        this.text(LEFT - 7, this.py(y) + 4, say(y), { "text-anchor": "end" });
      }
      const longest = Math.max(0, ...(this.names ?? []).map(n => n.length)), room = W - LEFT - RIGHT;
      const every = Math.ceil((this.names?.length ?? 0) * (7.2 * longest + 12) / room);
      const labels = this.names ? this.names.map((n, i) => [i, words(n)]).filter((_, i) => i % every === 0)
        : marks.x.map(x => [x, say(x)]);
      for (const [x, label] of labels) {
        this.node("line", { x1: this.px(x), x2: this.px(x), y1: bottom, y2: bottom + 4, class: "axis" });
        this.text(this.px(x), bottom + 17, label, { "text-anchor": "middle" });
      }
      this.node("line", { x1: LEFT, x2: W - RIGHT, y1: bottom, y2: bottom, class: "axis" });
      this.text((LEFT + W - RIGHT) / 2, H - 6, this.spec.x_label, { "text-anchor": "middle", class: "title" });
      this.text(14, (TOP + bottom) / 2, this.spec.y_label, { "text-anchor": "middle", class: "title",
        transform: `rotate(-90 14 ${(TOP + bottom) / 2})` });
      for (const s of this.series) s.group = this.node("g", { style: `--ink:var(--c-${s.colour})` });
      this.series.forEach(s => this.fill(s));
      this.cursor = this.node("line", { y1: TOP, y2: bottom, class: "cursor" });
      this.legend.replaceChildren(...(this.series.length > 1 || this.note ? this.series.map(s => {
        const entry = document.createElement("span");
        entry.innerHTML = '<svg width="26" height="8" aria-hidden="true"><line x1="1" y1="4" x2="25" y2="4"/></svg>';
        entry.style.setProperty("--ink", `var(--c-${s.colour})`);
        entry.querySelector("line").setAttribute("stroke-dasharray", s.dash);
        entry.append(" ", s.name);
        return entry;
      }) : []), this.note);
    }
    fill(s) {
      s.group.replaceChildren();
      const shown = s.points.filter(p => (!this.spec.log_x || p.x > 0));
      const banded = shown.filter(p => Number.isFinite(p.lo) && Number.isFinite(p.hi));
      const dots = this.spec.kind === "points";
      if (banded.length > 1 && !dots) {
        const there = banded.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.hi).toFixed(1)}`);
        const back = banded.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.lo).toFixed(1)}`).reverse();
        this.node("polygon", { points: [...there, ...back].join(" "), class: "band" }, s.group);
      }
      if (dots || shown.length === 1) for (const p of shown) this.node("circle", { cx: this.px(p.x).toFixed(1), cy: this.py(p.y).toFixed(1), r: 3.2 }, s.group);
      else this.node("polyline", { points: shown.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.y).toFixed(1)}`).join(" "),
        "stroke-dasharray": s.dash, "stroke-width": s.width ?? 1.8 }, s.group);
    }
    replace(index, points, name) {
      const s = this.series[index];
      s.points = points;
      if (name && name !== s.name) { s.name = name; this.draw(); } else this.fill(s);
      this.moved(false);
    }
    at(x, quiet = true) {
      let best = 0;
      this.xs.forEach((v, i) => { if (Math.abs(v - x) < Math.abs(this.xs[best] - x)) best = i; });
      this.slider.value = best; this.moved(!quiet);
    }
    moved(tell = true) {
      const x = this.xs[this.slider.value];
      if (x === undefined) return;
      this.cursor.setAttribute("x1", this.px(x)); this.cursor.setAttribute("x2", this.px(x));
      const label = this.names ? words(this.names[x]) : say(x);
      const values = this.series.map(s => [s, s.points.find(p => p.x === x)]).filter(([, p]) => p).map(([s, p]) => {
        const spread = Number.isFinite(p.lo) && Number.isFinite(p.hi) ? ` (${say(p.lo)} to ${say(p.hi)})` : "";
        return `${this.series.length > 1 ? s.name + " " : ""}${say(p.y)}${spread}`;
      });
      const read = `${this.spec.x_label}: ${label}. ${values.join("; ")}`;
      this.output.textContent = read;
      this.slider.setAttribute("aria-valuetext", read);
      if (tell && this.onmove) this.onmove(x);
    }
  }
  const roles = name => ROLES[name] ?? name;
  return { Chart, parse, series, bandWords, say, words, number, roles };
})();
