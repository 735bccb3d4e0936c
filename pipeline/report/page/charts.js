"use strict";
// Curves as SVG with the limits, bands and intervals of the printed pictures; each plot is a slider that reads off the
// values, by mouse, finger or keyboard, together with the other plots of its figure.
const Charts = (() => {
  const SVG = "http://www.w3.org/2000/svg", W = 640, PLOT = 236, ROW = 22, RIGHT = 14, LINE = 17, SIZE = 13, NOTE = 12, GAP = 4;
  const ROLES = JSON.parse(document.getElementById("roles").textContent), DASHES = { dashed: "7 4", dotted: "2 3" };
  const pen = document.createElement("canvas").getContext("2d");

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
  // Number rounded by the width of its interval: half of the width is 2 to 20 units of the last digit; `whole` keeps units.
  function within(v, ends, whole = true) {
    const half = ends ? Math.abs(ends[1] - ends[0]) / 2 : 0;
    if (!Number.isFinite(v) || !Number.isFinite(half)) return "–";
    if (!half) return say(Number(v.toPrecision(3)));
    const digits = Math.min(6, -Math.floor(Math.log10(half / 2))), places = Math.max(0, digits), unit = whole ? 1 : 10 ** Math.max(0, -digits);
    const text = (Math.round(v / unit * 10 ** places) / 10 ** places * unit).toFixed(places);
    return (Number(text) === 0 ? (0).toFixed(places) : Number(text).toLocaleString("en", { minimumFractionDigits: places, maximumFractionDigits: places })).replace("-", "−");
  }
  const words = name => String(name).replace(/\bmap\b/, "MAP").replaceAll("_", " ");
  const finite = ends => ends.every(Number.isFinite);

  // Lines of a chart with their points: value, interval (lo, hi) and band of the spread (low, high).
  function series(spec) {
    return spec.series.map(({ key, name, colour, line, width, x, y, lo, hi, low, high }) => ({ key, name, colour, dash: DASHES[line] ?? "", width: 1.8 * width,
      dots: line === "points" || !!spec.names, points: x.map((at, i) => ({ x: at, y: y[i], lo: lo?.[i] ?? NaN, hi: hi?.[i] ?? NaN, low: low?.[i] ?? NaN, high: high?.[i] ?? NaN })) }));
  }

  function ticks(low, high, log, count) {
    const out = [];
    if (log) {
      for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++)
        for (const m of high / low > 30 ? [1] : [1, 2, 5]) { const v = m * 10 ** e; if (v >= low * 0.999 && v <= high * 1.001) out.push(v); }
      return out;
    }
    const raw = (high - low || 1) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find(m => m * power >= raw * 0.999);
    for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-9; v += step) out.push(Math.abs(v) < step * 1e-9 ? 0 : v);
    return out;
  }

  class Chart {
    constructor(box, { series, names = null, spec, note = "" }) {
      Object.assign(this, { box, series, names, spec, note, onmove: null });
      box.replaceChildren();
      box.classList.add("chart");
      box.chart = this;
      this.svg = box.appendChild(document.createElementNS(SVG, "svg"));
      this.family = getComputedStyle(box).fontFamily;
      // The chart is as wide as its box, so that letters keep their size on a phone.
      this.wide = Math.max(names ? 280 : 250, Math.min(W, box.clientWidth || W));
      // A chart over names has a row for each name; its numbers run across.
      // Names that would leave less than half of the width stand above their rows.
      const widest = names ? 12 + Math.max(...names.map(n => this.measure(n, SIZE))) : 0;
      this.above = widest > 0.5 * this.wide;
      this.left = this.above ? 14 : widest;
      this.row = this.above ? 1.6 * ROW : ROW;
      this.heading = names ? [] : this.wrap(spec.y_label, this.wide - 4);
      this.title = this.wrap(names ? spec.y_label : spec.x_label, this.wide - this.left - RIGHT);
      this.top = 8 + LINE * this.heading.length;
      this.bottom = this.top + (names ? this.row * names.length : PLOT);
      this.high = this.bottom + 24 + LINE * this.title.length;
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
        this.go(this.nearest(x => Math.abs(along(x) - place)));
      };
      this.svg.addEventListener("pointermove", event => { if (event.pointerType === "mouse" ? !spec.held || event.buttons : event.buttons) follow(event); });
      this.svg.addEventListener("pointerdown", follow);
      this.svg.addEventListener("keydown", event => {
        const last = this.xs.length - 1, down = names ? 1 : -1, step = { ArrowRight: 1, ArrowUp: -down, ArrowLeft: -1, ArrowDown: down, PageUp: Math.ceil(last / 10), PageDown: -Math.ceil(last / 10), Home: -last, End: last }[event.key];
        if (step) { this.go(Math.max(0, Math.min(last, this.now + step))); event.preventDefault(); }
      });
      this.draw();
      this.moved(false);
    }
    measure(text, size) { pen.font = `${size}px ${this.family}`; return pen.measureText(text).width * 1.02; }
    wrap(text, room) {
      const lines = [];
      for (const word of text.split(" ")) {
        const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
        if (lines.length && this.measure(longer, SIZE + 0.5) <= room) lines[lines.length - 1] = longer; else lines.push(word);
      }
      return lines;
    }
    nearest(distance) { let best = 0; this.xs.forEach((x, i) => { if (distance(x) < distance(this.xs[best])) best = i; }); return best; }
    // Limits of the data, for charts whose series are computed on the page.
    range() {
      const { log_y, zero, least } = this.spec, points = this.series.flatMap(s => s.points);
      const ys = points.flatMap(p => [p.y, p.lo, p.hi]).filter(v => Number.isFinite(v) && (!log_y || v > 0));
      const low = zero ? Math.min(0, ...ys) : Math.min(...ys), high = Math.max(...ys), pad = (high - low || 1) * 0.05;
      return log_y ? [Math.max(low / 1.2, least ?? high * 1e-6), high * 1.2] : [zero && low === 0 ? 0 : low - pad, high + pad];
    }
    scales() {
      const { log_x, log_y } = this.spec, [y0, y1] = this.spec.limits ?? this.range();
      let [x0, x1] = this.spec.x_limits ?? [this.xs[0], this.xs.at(-1)];
      if (x0 === x1) { x0 -= 1; x1 += 1; }
      const map = (v, a, b, log) => log ? Math.log(Math.max(v, a) / a) / Math.log(b / a) : (v - a) / (b - a);
      const y = this.names ? [] : ticks(y0, y1, log_y, 5);
      if (!this.names) this.left = 12 + Math.max(...y.map(v => this.measure(say(v), SIZE)));
      const wide = this.wide - this.left - RIGHT, over = y => Math.max(-0.02, Math.min(1.02, map(y, y0, y1, log_y)));
      this.px = this.names ? y => this.left + wide * over(y) : x => this.left + wide * map(x, x0, x1, log_x);
      this.py = this.names ? x => this.top + this.row * (x + (this.above ? 0.72 : 0.5)) : y => this.bottom - (this.bottom - this.top) * over(y);
      const [a, b, log, asked] = this.names ? [y0, y1, log_y, null] : [x0, x1, log_x, this.spec.ticks];
      const step = typeof asked === "number" ? asked : 0;
      let x = Array.isArray(asked) ? asked : step ? Array.from({ length: Math.floor(b / step + 1e-9) - Math.ceil(a / step - 1e-9) + 1 }, (_, i) => (Math.ceil(a / step - 1e-9) + i) * step) : ticks(a, b, log, 6);
      // Every second number, and so on, until none touches its neighbour.
      const touches = all => all.some((v, i) => i && this.px(v) - this.px(all[i - 1]) < (this.measure(say(v), SIZE) + this.measure(say(all[i - 1]), SIZE)) / 2 + 6);
      while (x.length > 2 && touches(x)) { const zero = Math.max(0, x.indexOf(0)); x = x.filter((_, i) => (i - zero) % 2 === 0); }
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
      const marks = this.scales(), { left, top, bottom } = this, right = this.wide - RIGHT;
      for (const y of marks.y) {
        this.node("line", { x1: left, x2: right, y1: this.py(y), y2: this.py(y), class: "grid" });
        this.text(left - 6, this.py(y) + 4, say(y), { "text-anchor": "end" });
      }
      for (const x of marks.x) {
        const at = this.px(x), half = this.measure(say(x), SIZE) / 2;
        this.node("line", { x1: at, x2: at, y1: this.names ? top : bottom, y2: bottom + 4, class: this.names ? "grid" : "axis" });
        this.text(Math.min(at, this.wide - half - 1), bottom + 17, say(x), { "text-anchor": "middle" });
      }
      this.names?.forEach((name, i) => this.above ? this.text(2, this.py(i) - 10, name, {}) : this.text(left - 6, this.py(i) + 4, name, { "text-anchor": "end" }));
      this.node("line", { x1: left, x2: right, y1: bottom, y2: bottom, class: "axis" });
      this.title.forEach((line, i) => this.text((left + right) / 2, bottom + 20 + LINE * (i + 1) - 3, line, { "text-anchor": "middle", class: "title" }));
      this.heading.forEach((line, i) => this.text(2, LINE * (i + 1) - 3, line, { class: "title" }));
      for (const s of this.series) { s.group = this.node("g", {}); s.group.style.setProperty("--ink", `var(--c-${s.colour})`); }
      this.series.forEach(s => this.fill(s));
      const references = (this.spec.references ?? []).map(r => this.names ? { ...r, x: r.y, y: null } : r);
      const boxes = this.above ? this.names.map((name, i) => [2, this.py(i) - 24, 2 + this.measure(name, SIZE), this.py(i) - 6]) : [];
      for (const r of references) this.reference(r);
      for (const r of references) if (r.label && !r.below && (r.x !== null || r.y !== null)) boxes.push(this.label(r, references, boxes));
      this.cursor = this.node("line", this.names ? { x1: left, x2: right, class: "cursor" } : { y1: top, y2: bottom, class: "cursor" });
      const entries = [...this.series, ...references.filter(r => r.below).map(r => ({ name: r.label, colour: "black", dash: "7 4", points: [] }))];
      this.legend.replaceChildren(...(this.series.length > 1 || this.note ? entries.filter((s, i, all) => s.name && all.findIndex(o => o.name === s.name) === i).map(s => this.entry(s)) : []), this.note);
    }
    // Entry of the legend, with the marks of the series.
    entry(s) {
      const entry = document.createElement("span"), svg = document.createElementNS(SVG, "svg"), whiskers = s.points.some(p => finite([p.lo, p.hi]));
      for (const [name, value] of Object.entries({ width: 26, height: 12, "aria-hidden": "true" })) svg.setAttribute(name, value);
      entry.style.setProperty("--ink", `var(--c-${s.colour})`);
      if (s.dots) {
        if (whiskers) this.node("line", this.names ? { x1: 3, x2: 23, y1: 6, y2: 6 } : { x1: 13, x2: 13, y1: 0, y2: 12 }, svg);
        this.node("circle", { cx: 13, cy: 6, r: 3.2 }, svg);
      } else {
        if (s.points.some(p => finite([p.low, p.high]))) this.node("rect", { x: 1, y: 0, width: 24, height: 12, class: "band" }, svg);
        if (whiskers) this.node("rect", { x: 1, y: 2, width: 24, height: 8, class: "interval" }, svg);
        this.node("line", { x1: 1, x2: 25, y1: 6, y2: 6, "stroke-dasharray": s.dash, "stroke-width": s.width ?? 1.8 }, svg);
      }
      entry.append(svg, " ", s.name);
      return entry;
    }
    fill(s) {
      s.group.replaceChildren();
      const shown = s.points.filter(p => (!this.spec.log_x || p.x > 0)), dots = s.dots;
      const between = (low, high) => shown.filter(p => finite([p[low] ?? NaN, p[high] ?? NaN]));
      const corner = (x, y) => `${this.px(x).toFixed(1)},${this.py(y).toFixed(1)}`;
      if (!dots) for (const [low, high, name] of [["low", "high", "band"], ["lo", "hi", "interval"]]) {
        const held = between(low, high);
        if (held.length > 1) this.node("polygon", { points: [...held.map(p => corner(p.x, p[high])), ...held.map(p => corner(p.x, p[low])).reverse()].join(" "), class: name }, s.group);
      }
      const n = this.series.length, off = this.names && this.series.some(o => o !== s && o.points.some(p => shown.some(q => q.x === p.x))) ? (this.series.indexOf(s) / (n - 1) - 0.5) * ROW * (this.above ? 0.3 : 0.5) : 0;
      const place = (p, y) => this.names ? [this.px(y), this.py(p.x) + off] : [this.px(p.x), this.py(y)];
      if (dots || shown.length === 1) {
        const [low, high] = between("lo", "hi").length ? ["lo", "hi"] : ["low", "high"];
        for (const p of between(low, high)) { const [x1, y1] = place(p, p[low]), [x2, y2] = place(p, p[high]); this.node("line", { x1, x2, y1, y2, class: "whisker" }, s.group); }
        for (const p of shown) { const [cx, cy] = place(p, p.y); this.node("circle", { cx: cx.toFixed(1), cy: cy.toFixed(1), r: 3.2 }, s.group); }
      } else this.node("polyline", { points: shown.map(p => corner(p.x, p.y)).join(" "), "stroke-dasharray": s.dash, "stroke-width": s.width ?? 1.8 }, s.group);
    }
    // Reference: a horizontal or vertical line, a point, a line through the origin, or a percentage below a series.
    reference(r) {
      const kind = r.published ? "reference published" : "reference", right = this.wide - RIGHT;
      const points = corners => this.node("polyline", { points: corners.map(p => `${this.px(p.x).toFixed(1)},${this.py(p.y).toFixed(1)}`).join(" "), class: kind });
      const below = this.series.find(s => s.key === r.below);
      if (below) points(below.points.map(p => ({ x: p.x, y: p.y * (1 - r.percent / 100) })));
      else if (r.slope !== null) points((this.spec.x_limits ?? [this.xs[0], this.xs.at(-1)]).map(x => ({ x, y: r.slope * x })));
      else if (r.x !== null && r.y !== null) this.node("path", { d: `M${this.px(r.x)} ${this.py(r.y) - 6}l6 6l-6 6l-6-6z`, class: "reference published point" });
      else if (r.x !== null) this.node("line", { x1: this.px(r.x), x2: this.px(r.x), y1: this.top, y2: this.bottom, class: kind });
      else if (r.y !== null) this.node("line", { x1: this.left, x2: right, y1: this.py(r.y), y2: this.py(r.y), class: kind });
    }
    // Write the label of a reference where it covers no other label and the least of the data, as the pictures do.
    label(r, references, boxes) {
      const wide = this.measure(r.label, NOTE), high = NOTE * 1.2, right = this.wide - RIGHT;
      const shares = [1, 0, 0.5, 0.25, 0.75, ...Array.from({ length: 39 }, (_, k) => (k + 1) / 40)], at = [r.x === null ? null : this.px(r.x), r.y === null ? null : this.py(r.y)];
      const point = at[0] !== null && at[1] !== null, away = point ? 2.5 * GAP : GAP;
      const lefts = at[0] === null ? shares.map(f => this.left + GAP + f * (right - this.left - wide - 2 * GAP)) : [at[0] + away, at[0] - wide - away];
      const tops = at[1] === null ? shares.map(f => this.top + GAP + (1 - f) * (this.bottom - this.top - high - 2 * GAP)) : [at[1] - high - GAP, at[1] + GAP];
      if (point) tops.push(at[1] - high / 2);
      const marks = this.series.flatMap(s => s.points.flatMap((p, i) => {
        const x = this.names ? this.px(p.y) : this.px(p.x), y = this.names ? this.py(p.x) : this.py(p.y), next = s.points[i + 1];
        if (s.dots || this.names || !next) return [[x, y]];
        return Array.from({ length: 8 }, (_, k) => [x + (this.px(next.x) - x) * k / 8, y + (this.py(next.y) - y) * k / 8]);
      })).concat(references.flatMap(o => o.x !== null && o.y === null ? Array.from({ length: 40 }, (_, k) => [this.px(o.x), this.top + (this.bottom - this.top) * k / 39])
        : o.y !== null && o.x === null ? Array.from({ length: 40 }, (_, k) => [this.left + (right - this.left) * k / 39, this.py(o.y)]) : []));
      let best = null, least = Infinity;
      for (const y of tops) for (const x of lefts) {
        const box = [x, y, x + wide, y + high];
        const off = x < this.left || y < this.top || box[2] > this.wide || box[3] > this.bottom;
        const over = boxes.filter(b => box[0] < b[2] && b[0] < box[2] && box[1] < b[3] && b[1] < box[3]).length;
        const cost = 1e6 * (off + over) + marks.filter(([a, b]) => a > x - 1 && a < box[2] + 1 && b > y - 1 && b < box[3] + 1).length;
        if (cost < least) { least = cost; best = box; }
      }
      this.text(best[0], best[3] - 3, r.label, { class: "note" });
      return best;
    }
    replace(index, points, name) {
      const s = this.series[index];
      s.points = points;
      if (name && name !== s.name) { s.name = name; this.draw(); } else this.fill(s);
      this.moved(false);
    }
    at(x, quiet = true) { this.now = this.nearest(v => Math.abs(v - x)); this.moved(!quiet); }
    // Move the cursor, and those of the other charts of the figure over the same abscissa.
    go(index) {
      this.now = index;
      this.moved();
      if (this.spec.x) for (const { chart } of this.box.parentElement.querySelectorAll(":scope > .chart"))
        if (chart && chart !== this && chart.spec.x === this.spec.x && !chart.names === !this.names) chart.at(this.xs[index]);
    }
    moved(tell = true) {
      const x = this.xs[this.now];
      if (x === undefined) return;
      for (const end of [1, 2]) this.cursor.setAttribute(`${this.names ? "y" : "x"}${end}`, (this.names ? this.py : this.px)(x));
      const [, name, unit] = /^(.*?)(?: \(([^()]*)\))?$/.exec(this.spec.y_label), suffix = unit ? (unit === "°" || unit === "%" ? unit.replace("%", " %") : ` ${unit}`) : "";
      const [, across, mark] = /^(.*?)(?: \(([^()]*)\))?$/.exec(this.spec.x_label);
      const place = this.names ? this.names[x] : `${say(x)}${mark ? (mark.startsWith("°") ? "°" : ` ${mark}`) : ""}`;
      const values = this.series.map(s => [s, s.points.find(p => p.x === x)]).filter(([, p]) => p).map(([s, p]) => {
        const ends = finite([p.lo, p.hi]) ? [p.lo, p.hi] : null;
        return `${s.name || name} ${within(p.y, ends, false)}${suffix}${ends ? ` (${within(p.lo, ends, false)} to ${within(p.hi, ends, false)})` : ""}`;
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
