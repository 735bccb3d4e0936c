"use strict";
// Curves as SVG; each plot is a slider that reads off the values, by mouse, finger or keyboard.
const Charts = (() => {
  const SVG = "http://www.w3.org/2000/svg", W = 640, HIGH = 300, ROW = 22, BESIDE = 62, RIGHT = 14, TOP = 12, BOTTOM = 44;
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
  const say = v => !Number.isFinite(v) ? "–" : Math.abs(v) < 1e-9 ? "0" : (Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3 ? v.toExponential(1)
    : Number(v.toPrecision(4)).toLocaleString("en", { maximumFractionDigits: 6 })).replaceAll("-", "−");
  // Number rounded by the width of its interval: half of the width is 2 to 20 units of the last digit.
  function within(v, ends) {
    const half = ends ? Math.abs(ends[1] - ends[0]) / 2 : 0;
    if (!Number.isFinite(v) || !Number.isFinite(half)) return "–";
    if (!half) return say(Number(v.toPrecision(3)));
    const places = Math.min(6, Math.max(0, -Math.floor(Math.log10(half / 2)))), text = v.toFixed(places);
    return (Number(text) === 0 ? (0).toFixed(places) : Number(text).toLocaleString("en", { minimumFractionDigits: places, maximumFractionDigits: places })).replace("-", "−");
  }

  const words = name => String(name).replace(/\bmap\b/, "MAP").replaceAll("_", " ");

  // Lines of a chart with their points.
  function series(spec) {
    const dashes = { dashed: "7 4", dotted: "2 3" };
    return spec.series.map(({ key, name, colour, line, width, x, y, lo, hi }) => ({ key, name, colour, dash: dashes[line] ?? "", width: 1.8 * width,
      dots: line === "points" || !!spec.names, points: x.map((at, i) => ({ x: at, y: y[i], lo: lo?.[i] ?? NaN, hi: hi?.[i] ?? NaN })) }));
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
      // A chart over names has a row for each name; its numbers run across.
      this.high = names ? TOP + BOTTOM + ROW * names.length : HIGH;
      this.left = names ? Math.min(270, 14 + 7.8 * Math.max(...names.map(n => n.length))) : BESIDE;
      // The chart is as wide as its box, so that letters keep their size on a phone.
      this.wide = Math.max(this.left + (names ? 170 : 258), Math.min(W, box.clientWidth || W));
      this.svg.setAttribute("viewBox", `0 0 ${this.wide} ${this.high}`);
      // The plot is a slider: its marker follows the pointer and the arrow keys.
      for (const [name, value] of Object.entries({ role: "slider", tabindex: 0, "aria-orientation": names ? "vertical" : "horizontal", "aria-label": `${spec.y_label} against ${spec.x_label}` })) this.svg.setAttribute(name, value);
      this.legend = box.appendChild(document.createElement("p"));
      this.legend.className = "legend";
      this.xs = [...new Set(series.flatMap(s => s.points.map(p => p.x)))].sort((a, b) => a - b);
      this.now = Math.min(this.xs.length - 1, spec.start ?? Math.floor(this.xs.length / 2));
      this.output = box.appendChild(document.createElement("output"));
      const follow = event => {
        const at = this.svg.getBoundingClientRect();
        const place = names ? (event.clientY - at.top) / at.height * this.high : (event.clientX - at.left) / at.width * this.wide, along = names ? this.py : this.px;
        let best = 0;
        this.xs.forEach((x, i) => { if (Math.abs(along(x) - place) < Math.abs(along(this.xs[best]) - place)) best = i; });
        this.now = best; this.moved();
      };
      this.svg.addEventListener("pointermove", event => { if (event.pointerType === "mouse" ? !spec.held || event.buttons : event.buttons) follow(event); });
      this.svg.addEventListener("pointerdown", follow);
      this.svg.addEventListener("keydown", event => {
        const last = this.xs.length - 1, down = names ? 1 : -1, step = { ArrowRight: 1, ArrowUp: -down, ArrowLeft: -1, ArrowDown: down, PageUp: Math.ceil(last / 10), PageDown: -Math.ceil(last / 10), Home: -last, End: last }[event.key];
        if (step) { this.now = Math.max(0, Math.min(last, this.now + step)); this.moved(); event.preventDefault(); }
      });
      this.draw();
      this.moved(false);
    }
    scales() {
      const points = this.series.flatMap(s => s.points), { log_x, log_y, zero } = this.spec;
      const xs = points.map(p => p.x).filter(x => !log_x || x > 0);
      let ys = points.map(p => p.y).filter(y => !log_y || y > 0);
      for (const r of this.spec.references ?? []) if (r.published && r.y !== null) ys.push(r.y);
      const top = Math.max(...ys), least = Math.min(...ys);
      if (!log_y) ys = ys.concat(points.flatMap(p => [p.lo, p.hi]).filter(v => Number.isFinite(v) && v < top + (top - least || top) && v > least - (top - least)));
      let [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
      for (const r of this.spec.references ?? []) if (r.published && r.x !== null) { x0 = Math.min(x0, r.x); x1 = Math.max(x1, r.x); }
      if (zero && !log_y) y0 = Math.min(0, this.series.some(s => s.points.some(p => p.y < 0)) ? y0 : 0);
      if (log_y) { y0 = Math.max(y0, this.spec.least ?? y1 * 1e-6); y0 /= 1.2; y1 *= 1.2; } else { const pad = (y1 - y0 || 1) * 0.04; y1 += pad; if (!zero) y0 -= pad; }
      if (this.spec.limits) [y0, y1] = this.spec.limits;
      if (x0 === x1) { x0 -= 1; x1 += 1; }
      const x = this.names ? ticks(y0, y1, log_y) : ticks(x0, x1, log_x), y = this.names ? [] : ticks(y0, y1, log_y);
      // Space for the axis's title and the widest number.
      if (!this.names) this.left = Math.max(BESIDE, 34 + 7 * Math.max(...y.map(v => say(v).length)));
      const map = (v, a, b, log) => log ? Math.log(Math.max(v, a) / a) / Math.log(b / a) : (v - a) / (b - a);
      const wide = this.wide - this.left - RIGHT, over = y => Math.max(-0.02, Math.min(1.02, map(y, y0, y1, log_y)));
      this.px = this.names ? y => this.left + wide * over(y) : x => this.left + wide * map(x, x0, x1, log_x);
      this.py = this.names ? x => TOP + ROW * (x + 0.5) : y => this.high - BOTTOM - (this.high - TOP - BOTTOM) * over(y);
      return { x, y };
    }
    node(name, attributes, parent = this.svg) {
      const element = parent.appendChild(document.createElementNS(SVG, name));
      for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
      return element;
    }
    text(x, y, words, attributes) { this.node("text", { x, y, ...attributes }).textContent = words; }
    draw() {
      this.svg.replaceChildren();
      const marks = this.scales(), bottom = this.high - BOTTOM, left = this.left;
      for (const y of marks.y) {
        this.node("line", { x1: left, x2: this.wide - RIGHT, y1: this.py(y), y2: this.py(y), class: "grid" });
        this.text(left - 7, this.py(y) + 4, say(y), { "text-anchor": "end" });
      }
      for (const x of marks.x) {
        this.node("line", { x1: this.px(x), x2: this.px(x), y1: this.names ? TOP : bottom, y2: bottom + 4, class: this.names ? "grid" : "axis" });
        this.text(this.px(x), bottom + 17, say(x), { "text-anchor": "middle" });
      }
      this.names?.forEach((name, i) => this.text(left - 7, this.py(i) + 4, name, { "text-anchor": "end" }));
      this.node("line", { x1: left, x2: this.wide - RIGHT, y1: bottom, y2: bottom, class: "axis" });
      this.text((left + this.wide - RIGHT) / 2, this.high - 6, this.names ? this.spec.y_label : this.spec.x_label, { "text-anchor": "middle", class: "title" });
      if (!this.names) this.text(14, (TOP + bottom) / 2, this.spec.y_label, { "text-anchor": "middle", class: "title",
        transform: `rotate(-90 14 ${(TOP + bottom) / 2})` });
      for (const s of this.series) { s.group = this.node("g", {}); s.group.style.setProperty("--ink", `var(--c-${s.colour})`); }
      this.series.forEach(s => this.fill(s));
      for (const r of this.spec.references ?? []) this.reference(r, bottom);
      this.cursor = this.node("line", this.names ? { x1: left, x2: this.wide - RIGHT, class: "cursor" } : { y1: TOP, y2: bottom, class: "cursor" });
      const below = (this.spec.references ?? []).filter(r => r.below).map(r => ({ name: r.label, colour: "black", dash: "7 4" }));
      this.legend.replaceChildren(...(this.series.length > 1 || this.note ? [...this.series, ...below].filter((s, i, all) => s.name && all.findIndex(o => o.name === s.name) === i).map(s => {
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
      const dots = s.dots;
      if (banded.length > 1 && !dots) {
        const upper = banded.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.hi).toFixed(1)}`);
        const lower = banded.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.lo).toFixed(1)}`).reverse();
        this.node("polygon", { points: [...upper, ...lower].join(" "), class: "band" }, s.group);
      }
      const n = this.series.length, off = this.names && this.series.some(o => o !== s && o.points.some(p => shown.some(q => q.x === p.x))) ? (this.series.indexOf(s) / (n - 1) - 0.5) * ROW * 0.5 : 0;
      const place = (p, y) => this.names ? [this.px(y), this.py(p.x) + off] : [this.px(p.x), this.py(y)];
      if (dots) for (const p of banded) { const [x1, y1] = place(p, p.lo), [x2, y2] = place(p, p.hi); this.node("line", { x1, x2, y1, y2, class: "whisker" }, s.group); }
      if (dots || shown.length === 1) for (const p of shown) { const [cx, cy] = place(p, p.y); this.node("circle", { cx: cx.toFixed(1), cy: cy.toFixed(1), r: 3.2 }, s.group); }
      else this.node("polyline", { points: shown.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.y).toFixed(1)}`).join(" "),
        "stroke-dasharray": s.dash, "stroke-width": s.width ?? 1.8 }, s.group);
    }
    // Reference: a horizontal or vertical line, a point, a line through the origin, or a percentage below a series.
    reference(r, bottom) {
      if (this.names) {
        if (r.y === null) return;
        this.node("line", { x1: this.px(r.y), x2: this.px(r.y), y1: TOP, y2: bottom, class: r.published ? "reference published" : "reference" });
        if (r.label) this.text(this.px(r.y) + 5, TOP + 10, r.label, { class: "note" });
        return;
      }
      const kind = r.published ? "reference published" : "reference", points = (name, corners) => this.node("polyline", { points: corners.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.y).toFixed(1)}`).join(" "), class: name });
      const below = this.series.find(s => s.key === r.below), ends = [this.xs[0], this.xs.at(-1)];
      if (below) points(kind, below.points.map(p => ({ x: p.x, y: p.y * (1 - r.percent / 100) })));
      else if (r.slope !== null) points(kind, ends.map(x => ({ x, y: r.slope * x })));
      else if (r.x !== null && r.y !== null) this.node("path", { d: `M${this.px(r.x)} ${this.py(r.y) - 6}l6 6l-6 6l-6-6z`, class: "reference published point" });
      else if (r.x !== null) this.node("line", { x1: this.px(r.x), x2: this.px(r.x), y1: TOP, y2: bottom, class: kind });
      else if (r.y !== null) this.node("line", { x1: this.left, x2: this.wide - RIGHT, y1: this.py(r.y), y2: this.py(r.y), class: kind });
      if (!r.label || below) return;
      const right = r.x !== null && this.px(r.x) > 0.6 * this.wide;
      const x = r.x !== null ? this.px(r.x) + (right ? -9 : 9) : this.wide - RIGHT - 4;
      const y = r.y !== null ? this.py(r.y) + (r.x !== null ? 4 : -5) : TOP + 12;
      this.text(x, y, r.label, { "text-anchor": r.x !== null ? (right ? "end" : "start") : "end", class: "note" });
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
      this.now = best; this.moved(!quiet);
    }
    moved(tell = true) {
      const x = this.xs[this.now];
      if (x === undefined) return;
      for (const end of [1, 2]) this.cursor.setAttribute(`${this.names ? "y" : "x"}${end}`, (this.names ? this.py : this.px)(x));
      const [, name, unit] = /^(.*?)(?: \(([^()]*)\))?$/.exec(this.spec.y_label), suffix = unit ? (unit === "°" || unit === "%" ? unit.replace("%", " %") : ` ${unit}`) : "";
      const [, across, mark] = /^(.*?)(?: \(([^()]*)\))?$/.exec(this.spec.x_label);
      const place = this.names ? this.names[x] : `${say(x)}${mark ? (mark.startsWith("°") ? "°" : ` ${mark}`) : ""}`;
      const values = this.series.map(s => [s, s.points.find(p => p.x === x)]).filter(([, p]) => p).map(([s, p]) => {
        const ends = Number.isFinite(p.lo) && Number.isFinite(p.hi) ? [p.lo, p.hi] : null;
        return `${s.name || name} ${within(p.y, ends)}${suffix}${ends ? ` (${within(p.lo, ends)} to ${within(p.hi, ends)})` : ""}`;
      });
      const read = `${across} ${place}: ${values.join("; ")}`;
      this.output.textContent = read;
      for (const [key, value] of [["min", 0], ["max", this.xs.length - 1], ["now", this.now], ["text", read]]) this.svg.setAttribute(`aria-value${key}`, value);
      if (tell && this.onmove) this.onmove(x);
    }
  }
  const roles = name => ROLES[name] ?? name;
  return { Chart, parse, series, say, within, words, number, roles };
})();
