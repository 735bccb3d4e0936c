"use strict";
// Many people in one chart: a strip with a dot for each person and the quantiles, in place of a row for each.
const Strips = (() => {
  const SVG = "http://www.w3.org/2000/svg", WIDE = 640, LEFT = 14, RIGHT = 14, STRIP = 74, TOP = 26, BOTTOM = 44, LEAST = 30, SHARES = [0.05, 0.25, 0.5, 0.75, 0.95];
  const PEOPLE = /^(walker|performance|clip|person)\b/;
  const wanted = spec => spec.names?.length >= LEAST && PEOPLE.test(spec.x_label);
  function quantile(sorted, share) {
    const at = share * (sorted.length - 1), low = Math.floor(at);
    return sorted[low] + (at - low) * (sorted[Math.min(low + 1, sorted.length - 1)] - sorted[low]);
  }
  function draw(box, spec, series) {
    const svg = document.createElementNS(SVG, "svg"), high = TOP + STRIP * series.length + BOTTOM;
    const node = (name, attributes, text = "", parent = svg) => {
      const element = parent.appendChild(document.createElementNS(SVG, name));
      for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
      element.textContent = text;
      return element;
    };
    const values = series.flatMap(s => s.points.map(p => p.y)).filter(Number.isFinite), low = Math.min(spec.zero ? 0 : Infinity, ...values), top = Math.max(...values);
    const px = v => LEFT + (WIDE - LEFT - RIGHT) * (v - low) / (top - low || 1), unit = /\(([^()]*)\)$/.exec(spec.y_label)?.[1] ?? "";
    svg.setAttribute("viewBox", `0 0 ${WIDE} ${high}`);
    const power = 10 ** Math.floor(Math.log10((top - low || 1) / 6)), step = power * [1, 2, 5, 10].find(m => m * power >= (top - low || 1) / 6);
    for (let v = Math.ceil(low / step - 1e-9) * step; v <= top + step * 1e-9; v += step) {
      node("line", { x1: px(v), x2: px(v), y1: TOP - 6, y2: high - BOTTOM, class: "grid" });
      node("text", { x: px(v), y: high - BOTTOM + 17, "text-anchor": "middle" }, Charts.say(Number(v.toPrecision(6))));
    }
    node("text", { x: WIDE / 2, y: high - 6, "text-anchor": "middle", class: "title" }, spec.y_label);
    const sentences = series.map((s, n) => {
      const group = node("g", {}), middle = TOP + STRIP * n + STRIP / 2 + 6, sorted = s.points.map(p => p.y).filter(Number.isFinite).sort((a, b) => a - b), q = SHARES.map(share => quantile(sorted, share));
      group.style.setProperty("--ink", `var(--c-${s.colour})`);
      node("text", { x: LEFT, y: middle - STRIP / 2 + 12, class: "title" }, s.name || "");
      node("line", { x1: px(q[0]), x2: px(q[4]), y1: middle, y2: middle, class: "whisker" }, "", group);
      node("rect", { x: px(q[1]), y: middle - 13, width: Math.max(px(q[3]) - px(q[1]), 1), height: 26, class: "quartiles" }, "", group);
      node("line", { x1: px(q[2]), x2: px(q[2]), y1: middle - 16, y2: middle + 16, class: "median" }, "", group);
      // Dots are spread over the strip by the golden ratio, so that neighbours do not cover one another.
      s.points.forEach((p, i) => { if (Number.isFinite(p.y)) node("title", {}, `${Charts.words(spec.names[p.x])}: ${Charts.say(Number(p.y.toPrecision(3)))} ${unit}`, node("circle", { cx: px(p.y).toFixed(1), cy: (middle - 11 + 22 * ((i * 0.618034) % 1)).toFixed(1), r: 2.4 }, "", group)); });
      const say = v => Charts.say(Number(v.toPrecision(3)));
      return `${s.name ? `${s.name}: ` : ""}median ${say(q[2])} ${unit}, quartiles ${say(q[1])} to ${say(q[3])}, 5 to 95 %: ${say(q[0])} to ${say(q[4])} (${sorted.length})`;
    });
    svg.setAttribute("role", "img"); svg.setAttribute("aria-label", `${spec.y_label} by ${spec.x_label}. ${sentences.join(". ")}`);
    box.classList.add("chart", "strip-of-people");
    box.replaceChildren(svg, Object.assign(document.createElement("p"), { className: "legend", textContent: `A dot for each ${spec.x_label}; box: quartiles; line: 5 to 95 %. ${sentences.join("; ")}.` }));
  }
  return { wanted, draw };
})();
