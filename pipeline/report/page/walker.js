"use strict";
// Mathematics of the players: the computations of pipeline/core, for one walker at a time.
//
// A walker is 225 numbers, coefficient x joint x space, in the printed order p0, p1, q1, p2, q2 (p: sine, q: cosine).
// A fold is trained on all other people.  It reconstructs one flat view by solving (A + sigma2 I) z = h.
const Gait = (() => {
  const JOINTS = 15, POINTS = 75, SIZE = 225, MAX_COMPONENTS = 60;
  const WEIGHTS = [1, 0.5, 0.5, 0.5, 0.5];  // mean square of each basis function over a cycle
  const RANK_TOLERANCE = 1e-13, PIVOT_TOLERANCE = 1e-10, SD_TOLERANCE = 1e-12;

  function bytes(text) {
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out.buffer;
  }
  const floats = text => new Float32Array(bytes(text));

  function dequantise(packed) {
    const offset = floats(packed.offset), scale = floats(packed.scale), integers = new Int16Array(bytes(packed.integers));
    const out = new Float64Array(integers.length), width = offset.length;
    for (let i = 0; i < out.length; i++) out[i] = offset[i % width] + scale[i % width] * integers[i];
    return out;
  }

  function people(packed) {
    return {
      ...packed, count: packed.names.length, samples: Float64Array.from(floats(packed.samples)), folds: new Map(),
      residual: floats(packed.residual), temporal: floats(packed.temporal),
    };
  }
  const walker = (p, r) => p.samples.subarray(r * SIZE, (r + 1) * SIZE);

  // Descending eigenvalues and eigenvectors (in rows) of a symmetric matrix, by Householder reduction and QL.
  function symmetricEigen(matrix, n) {
    const V = Float64Array.from(matrix), d = new Float64Array(n), e = new Float64Array(n);
    for (let j = 0; j < n; j++) d[j] = V[(n - 1) * n + j];
    for (let i = n - 1; i > 0; i--) {
      let scale = 0, h = 0;
      for (let k = 0; k < i; k++) scale += Math.abs(d[k]);
      if (scale === 0) {
        e[i] = d[i - 1];
        for (let j = 0; j < i; j++) { d[j] = V[(i - 1) * n + j]; V[i * n + j] = 0; V[j * n + i] = 0; }
      } else {
        for (let k = 0; k < i; k++) { d[k] /= scale; h += d[k] * d[k]; }
        let f = d[i - 1], g = f > 0 ? -Math.sqrt(h) : Math.sqrt(h);
        e[i] = scale * g; h -= f * g; d[i - 1] = f - g;
        for (let j = 0; j < i; j++) e[j] = 0;
        for (let j = 0; j < i; j++) {
          f = d[j]; V[j * n + i] = f; g = e[j] + V[j * n + j] * f;
          for (let k = j + 1; k < i; k++) { g += V[k * n + j] * d[k]; e[k] += V[k * n + j] * f; }
          e[j] = g;
        }
        f = 0;
        for (let j = 0; j < i; j++) { e[j] /= h; f += e[j] * d[j]; }
        const hh = f / (h + h);
        for (let j = 0; j < i; j++) e[j] -= hh * d[j];
        for (let j = 0; j < i; j++) {
          f = d[j]; g = e[j];
          for (let k = j; k < i; k++) V[k * n + j] -= f * e[k] + g * d[k];
          d[j] = V[(i - 1) * n + j]; V[i * n + j] = 0;
        }
      }
      d[i] = h;
    }
    for (let i = 0; i < n - 1; i++) {
      V[(n - 1) * n + i] = V[i * n + i]; V[i * n + i] = 1;
      const h = d[i + 1];
      if (h !== 0) {
        for (let k = 0; k <= i; k++) d[k] = V[k * n + i + 1] / h;
        for (let j = 0; j <= i; j++) {
          let g = 0;
          for (let k = 0; k <= i; k++) g += V[k * n + i + 1] * V[k * n + j];
          for (let k = 0; k <= i; k++) V[k * n + j] -= g * d[k];
        }
      }
      for (let k = 0; k <= i; k++) V[k * n + i + 1] = 0;
    }
    for (let j = 0; j < n; j++) { d[j] = V[(n - 1) * n + j]; V[(n - 1) * n + j] = 0; }
    V[n * n - 1] = 1; e[0] = 0;
    for (let i = 1; i < n; i++) e[i - 1] = e[i];
    e[n - 1] = 0;
    let f = 0, largest = 0;
    for (let l = 0; l < n; l++) {
      largest = Math.max(largest, Math.abs(d[l]) + Math.abs(e[l]));
      let m = l;
      while (m < n - 1 && Math.abs(e[m]) > Number.EPSILON * largest) m++;
      for (let turn = 0; m > l && turn < 200; turn++) {
        let g = d[l], p = (d[l + 1] - g) / (2 * e[l]), r = Math.hypot(p, 1);
        if (p < 0) r = -r;
        d[l] = e[l] / (p + r); d[l + 1] = e[l] * (p + r);
        const next = d[l + 1]; let h = g - d[l];
        for (let i = l + 2; i < n; i++) d[i] -= h;
        f += h; p = d[m];
        let c = 1, c2 = 1, c3 = 1, s = 0, s2 = 0; const after = e[l + 1];
        for (let i = m - 1; i >= l; i--) {
          c3 = c2; c2 = c; s2 = s; g = c * e[i]; h = c * p; r = Math.hypot(p, e[i]);
          e[i + 1] = s * r; s = e[i] / r; c = p / r; p = c * d[i] - s * g;
          d[i + 1] = h + s * (c * g + s * d[i]);
          for (let k = 0; k < n; k++) {
            h = V[k * n + i + 1];
            V[k * n + i + 1] = s * V[k * n + i] + c * h; V[k * n + i] = c * V[k * n + i] - s * h;
          }
        }
        p = -s * s2 * c3 * after * e[l] / next; e[l] = s * p; d[l] = c * p;
        if (Math.abs(e[l]) <= Number.EPSILON * largest) break;
      }
      d[l] += f; e[l] = 0;
    }
    const order = [...d.keys()].sort((a, b) => d[b] - d[a]);
    const rows = new Float64Array(n * n);
    order.forEach((from, to) => { for (let k = 0; k < n; k++) rows[to * n + k] = V[k * n + from]; });
    return { values: Float64Array.from(order, i => d[i]), rows };
  }

  // Average walker and eigenwalkers of all people but one (-1: of all people).
  function learn(p, without) {
    const training = [];
    for (let r = 0; r < p.count; r++) if (without < 0 || p.person[r] !== p.person[without]) training.push(r);
    const n = training.length, mean = new Float64Array(SIZE), X = new Float64Array(n * SIZE);
    for (const r of training) { const w = walker(p, r); for (let i = 0; i < SIZE; i++) mean[i] += w[i] / n; }
    training.forEach((r, row) => { const w = walker(p, r); for (let i = 0; i < SIZE; i++) X[row * SIZE + i] = w[i] - mean[i]; });
    const wide = n > SIZE, side = wide ? SIZE : n, G = new Float64Array(side * side);
    for (let a = 0; a < side; a++) for (let b = 0; b <= a; b++) {
      let sum = 0;
      if (wide) for (let r = 0; r < n; r++) sum += X[r * SIZE + a] * X[r * SIZE + b];
      else for (let i = 0; i < SIZE; i++) sum += X[a * SIZE + i] * X[b * SIZE + i];
      G[a * side + b] = G[b * side + a] = sum;
    }
    const eigen = symmetricEigen(G, side), count = Math.min(MAX_COMPONENTS, n - 1, SIZE);
    const values = new Float64Array(count), E = new Float64Array(count * SIZE);
    let total = 0;
    for (let a = 0; a < side; a++) total += Math.max(eigen.values[a], 0) / (n - 1);
    for (let k = 0; k < count; k++) {
      const power = Math.max(eigen.values[k], 0);
      values[k] = power / (n - 1);
      const row = E.subarray(k * SIZE, (k + 1) * SIZE);
      if (wide) row.set(eigen.rows.subarray(k * side, (k + 1) * side));
      else if (power > 0) {
        for (let r = 0; r < n; r++) {
          const weight = eigen.rows[k * side + r] / Math.sqrt(power);
          for (let i = 0; i < SIZE; i++) row[i] += weight * X[r * SIZE + i];
        }
      }
      let largest = 0;
      for (let i = 0; i < SIZE; i++) if (Math.abs(row[i]) > Math.abs(row[largest]) * (1 + 1e-6)) largest = i;
      if (row[largest] < 0) for (let i = 0; i < SIZE; i++) row[i] = -row[i];
    }
    return { mean, values, E, count, total, people: n, parts: parts(E, count) };
  }

  function parts(E, n) {  // E^T E split by axis: xx, xy + yx, yy, zz
    const out = [0, 1, 2, 3].map(() => new Float64Array(n * n));
    for (let a = 0; a < n; a++) for (let b = 0; b <= a; b++) {
      let xx = 0, xy = 0, yy = 0, zz = 0;
      for (let i = 0; i < SIZE; i += 3) {
        const ax = E[a * SIZE + i], ay = E[a * SIZE + i + 1], az = E[a * SIZE + i + 2];
        const bx = E[b * SIZE + i], by = E[b * SIZE + i + 1], bz = E[b * SIZE + i + 2];
        xx += ax * bx; xy += ax * by + ay * bx; yy += ay * by; zz += az * bz;
      }
      [xx, xy, yy, zz].forEach((v, q) => { out[q][a * n + b] = out[q][b * n + a] = v; });
    }
    return out;
  }

  function fold(p, r) {
    if (!p.folds.has(r)) {
      const model = learn(p, r), w = r < 0 ? model.mean : walker(p, r);
      const d = Float64Array.from(w, (v, i) => v - model.mean[i]);
      const h = [0, 1, 2, 3].map(() => new Float64Array(model.count));
      for (let k = 0; k < model.count; k++) for (let i = 0; i < SIZE; i += 3) {
        const [ex, ey, ez] = [model.E[k * SIZE + i], model.E[k * SIZE + i + 1], model.E[k * SIZE + i + 2]];
        h[0][k] += ex * d[i]; h[1][k] += ex * d[i + 1] + ey * d[i]; h[2][k] += ey * d[i + 1]; h[3][k] += ez * d[i + 2];
      }
      if (p.folds.size > 12) p.folds.delete(p.folds.keys().next().value);
      p.folds.set(r, { ...model, d, h, walker: w, people: p, r });
    }
    return p.folds.get(r);
  }

  // Solution of A x = b by Cholesky, or null if a pivot is near rounding error.
  function cholesky(A, b, n) {
    const L = new Float64Array(n * n);
    let smallest = Infinity, largest = 0;
    for (let i = 0; i < n; i++) for (let j = 0; j <= i; j++) {
      let sum = A[i * n + j];
      for (let k = 0; k < j; k++) sum -= L[i * n + k] * L[j * n + k];
      if (i === j) {
        if (!(sum > 0)) return null;
        smallest = Math.min(smallest, sum); largest = Math.max(largest, sum);
        L[i * n + i] = Math.sqrt(sum);
      } else L[i * n + j] = sum / L[j * n + j];
    }
    if (smallest <= PIVOT_TOLERANCE * largest) return null;
    const x = Float64Array.from(b);
    for (let i = 0; i < n; i++) { for (let k = 0; k < i; k++) x[i] -= L[i * n + k] * x[k]; x[i] /= L[i * n + i]; }
    for (let i = n - 1; i >= 0; i--) { for (let k = i + 1; k < n; k++) x[i] -= L[k * n + i] * x[k]; x[i] /= L[i * n + i]; }
    return x;
  }

  function leastNorm(A, b, n) {
    const { values, rows } = symmetricEigen(A, n), x = new Float64Array(n);
    for (let q = 0; q < n; q++) {
      if (values[q] <= RANK_TOLERANCE * values[0]) continue;
      let dot = 0;
      for (let k = 0; k < n; k++) dot += rows[q * n + k] * b[k];
      for (let k = 0; k < n; k++) x[k] += dot / values[q] * rows[q * n + k];
    }
    return x;
  }

  // Coefficients of the first n eigenwalkers from one view; least squares if sigma2 is null.
  function coefficients(f, n, angle, sigma2) {
    n = Math.min(n, f.count);
    const c = Math.cos(angle), s = Math.sin(angle), w = [c * c, s * c, s * s, 1];
    const top = Math.sqrt(f.values[0]);
    const scale = Float64Array.from(f.values.subarray(0, n), v => {
      const sd = Math.sqrt(v);
      return sigma2 === null ? (sd > SD_TOLERANCE * top ? 1 : 0) : sd;
    });
    const A = new Float64Array(n * n), b = new Float64Array(n);
    for (let i = 0; i < n; i++) {
      for (let j = 0; j <= i; j++) {
        const at = i * f.count + j;
        const v = w[0] * f.parts[0][at] + w[1] * f.parts[1][at] + w[2] * f.parts[2][at] + f.parts[3][at];
        A[i * n + j] = A[j * n + i] = v * scale[i] * scale[j];
      }
      A[i * n + i] += sigma2 ?? 0;
      b[i] = scale[i] * (w[0] * f.h[0][i] + w[1] * f.h[1][i] + w[2] * f.h[2][i] + f.h[3][i]);
    }
    const z = cholesky(A, b, n) ?? leastNorm(A, b, n);
    return z.map((v, i) => v * scale[i]);
  }

  // Methods: `estimate` returns the coefficients of the eigenwalkers, or `missing` returns the missing dimension.
  // A plug-in's method may have a `step` (name, button, words) on the first screen, a `note` under the player's table,
  // `words` on one view, and a `cloud` of samples.
  const METHODS = {
    map: { label: "MAP (with the prior)", role: "map", prior: true, estimate: coefficients },
    least_squares: { label: "least squares", role: "least_squares", prior: false,
      estimate: (f, n, angle) => coefficients(f, n, angle, null) },
    baseline: { label: "average walker", role: "baseline", prior: false, estimate: () => new Float64Array(0) },
  };

  // Reconstructed missing dimension (5 x 15), and the true less the reconstructed one.
  function reconstruct(f, method, n, angle, sigma2) {
    const how = METHODS[method], c = Math.cos(angle), s = Math.sin(angle);
    const missing = how.missing ? how.missing(f, angle) : ofEigenwalkers(f, how.estimate(f, n, angle, sigma2), angle);
    return { missing, delta: missing.map((value, i) => -s * f.walker[3 * i] + c * f.walker[3 * i + 1] - value) };
  }
  function ofEigenwalkers(f, k, angle) {
    const c = Math.cos(angle), s = Math.sin(angle), missing = new Float64Array(POINTS);
    for (let i = 0; i < POINTS; i++) {
      let value = -s * f.mean[3 * i] + c * f.mean[3 * i + 1];
      for (let q = 0; q < k.length; q++) value += k[q] * (-s * f.E[q * SIZE + 3 * i] + c * f.E[q * SIZE + 3 * i + 1]);
      missing[i] = value;
    }
    return missing;
  }

  function along(covariance, r, j, angle) {
    const at = (r * JOINTS + j) * 3, c = Math.cos(angle), s = Math.sin(angle);
    return s * s * covariance[at] - 2 * s * c * covariance[at + 1] + c * c * covariance[at + 2];
  }

  // Mean square error in the missing dimension (mm²), its root, and its ratio to the variance of that dimension.
  function errors(p, r, delta, angle) {
    let absolute = 0, variance = 0;
    for (let j = 0; j < JOINTS; j++) {
      for (let b = 0; b < 5; b++) absolute += WEIGHTS[b] * delta[b * JOINTS + j] ** 2;
      absolute += along(p.residual, r, j, angle);
      variance += along(p.temporal, r, j, angle);
    }
    absolute /= JOINTS; variance /= JOINTS;
    return { absolute, rms: Math.sqrt(absolute), relative: absolute / variance, variance };
  }

  // 3D coefficients from the observed dimensions and the reconstructed missing one.
  function combine(w, missing, angle) {
    const c = Math.cos(angle), s = Math.sin(angle), out = new Float64Array(SIZE);
    for (let i = 0; i < POINTS; i++) {
      const across = c * w[3 * i] + s * w[3 * i + 1];
      out[3 * i] = c * across - s * missing[i]; out[3 * i + 1] = s * across + c * missing[i]; out[3 * i + 2] = w[3 * i + 2];
    }
    return out;
  }

  // Joints (45 numbers) at a fraction of the cycle.
  function posture(w, cycle) {
    const t = 2 * Math.PI * cycle, f = [1, Math.sin(t), Math.cos(t), Math.sin(2 * t), Math.cos(2 * t)];
    const out = new Float64Array(45);
    for (let b = 0; b < 5; b++) for (let i = 0; i < 45; i++) out[i] += f[b] * w[b * 45 + i];
    return out;
  }

  // Joint triples of the inner angles: elbows, knees, and upper arms and thighs against the trunk.
  const ANGLES = [[2, 3, 4], [5, 6, 7], [9, 10, 11], [12, 13, 14], [3, 2, 9], [6, 5, 12], [10, 9, 2], [13, 12, 5]];
  function angle(q, [a, b, c]) {
    let dot = 0, u = 0, v = 0;
    for (let x = 0; x < 3; x++) {
      const p = q[3 * a + x] - q[3 * b + x], o = q[3 * c + x] - q[3 * b + x];
      dot += p * o; u += p * p; v += o * o;
    }
    return Math.acos(Math.max(-1, Math.min(1, dot / Math.sqrt(u * v)))) * 180 / Math.PI;
  }
  function angleError(first, other, instants = 24) {
    let sum = 0;
    for (let t = 0; t < instants; t++) {
      const a = posture(first, t / instants), b = posture(other, t / instants);
      for (const triple of ANGLES) sum += (angle(a, triple) - angle(b, triple)) ** 2;
    }
    return Math.sqrt(sum / (instants * ANGLES.length));
  }

  // Camera centre and direction of the ray through a pixel, from a 3 x 4 camera matrix.
  function ray(P, u, v) {
    const m = (i, j) => P[4 * i + j], cof = [];
    for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) {
      const [a, b, c, d] = [(i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3];
      cof[3 * j + i] = m(a, c) * m(b, d) - m(a, d) * m(b, c);
    }
    const det = m(0, 0) * cof[0] + m(0, 1) * cof[3] + m(0, 2) * cof[6];
    const times = w => [0, 1, 2].map(i => (cof[3 * i] * w[0] + cof[3 * i + 1] * w[1] + cof[3 * i + 2] * w[2]) / det);
    const centre = times([-P[3], -P[7], -P[11]]);
    let way = times([u, v, 1]);
    const ahead = m(2, 0) * way[0] + m(2, 1) * way[1] + m(2, 2) * way[2] < 0 ? -1 : 1;
    const norm = Math.hypot(...way) * ahead;
    way = way.map(x => x / norm);
    return { centre, way };
  }

  // The two points of a ray at a given distance from a parent, near and far; its nearest point twice if it misses.
  function candidates({ centre, way }, parent, radius) {
    const away = [0, 1, 2].map(i => parent[i] - centre[i]);
    const middle = away[0] * way[0] + away[1] * way[1] + away[2] * way[2];
    const gap = away.reduce((sum, v) => sum + v * v, 0) - middle * middle, half = Math.sqrt(Math.max(radius * radius - gap, 0));
    const at = depth => [0, 1, 2].map(i => centre[i] + depth * way[i]);
    return { near: at(middle - half), far: at(middle + half), half, hit: gap <= radius * radius };
  }

  return { people, walker, fold, learn, reconstruct, errors, combine, posture, angleError, METHODS, dequantise, floats,
    ray, candidates, JOINTS, SIZE };
})();
