"use strict";
// Anatomical reconstruction of walk3d/anatomy/prior, for one walker at a time.  A prior of mirrored, shrunken walks gives
// the missing dimension from the flat view; then bones get a constant length, left and right alike.
//
// Coefficients are in the order (joint, axis, block), axes across, up and away; U of them are unknown.
const Anatomy = (() => {
  const { JOINTS, SIZE } = Gait, BLOCKS = 5, HARMONICS = 2, PHASES = 20, INSTANTS = 8, CLOUD = 12, NORMAL_95 = 1.959963984540054;
  const SHRINKAGE = { within: 0.2, diagonal: 0.1, extra: 20 }, NOISE = { variance: 100, share: 0.2 };
  const FACTORS = { within: 1.5, pairs: 2 }, MIN_VARIANCE = 1;
  const GAUSS_NEWTON_STEPS = 3, STEP_MM = 1e-3, MAX_STEPS = 60, MAX_HALVINGS = 12, ROUNDING_TOLERANCE = 1e-12;
  const SIDES = [0, 1, 5, 6, 7, 2, 3, 4, 8, 12, 13, 14, 9, 10, 11];  // for each joint, the joint on the other side
  const BONES = [...JSON.parse(document.getElementById("bones").textContent), [9, 12], [2, 5]];
  const named = bone => [...bone].sort((a, b) => a - b).join(), places = new Map(BONES.map((bone, b) => [named(bone), b]));
  const PAIRS = BONES.map((bone, b) => [b, places.get(named(bone.map(j => SIDES[j])))]).filter(([b, other]) => b < other);
  const BASIS = Float64Array.from({ length: PHASES * BLOCKS }, (_, i) => basis(Math.floor(i / BLOCKS) / PHASES)[i % BLOCKS]);

  function basis(cycle) {
    const t = 2 * Math.PI * cycle;
    return [1, Math.sin(t), Math.cos(t), Math.sin(2 * t), Math.cos(2 * t)];
  }

  // --- symmetric matrices, row by row --------------------------------------------------------------------------

  // Lower Cholesky factor, in place, or null without one.
  function factor(A, n) {
    for (let i = 0; i < n; i++) {
      const row = A.subarray(i * n, i * n + i + 1);
      for (let j = 0; j <= i; j++) {
        const other = A.subarray(j * n, j * n + j + 1);
        let sum = row[j];
        for (let k = 0; k < j; k++) sum -= row[k] * other[k];
        if (j < i) row[j] = sum / other[j];
        else if (sum > 0) row[j] = Math.sqrt(sum);
        else return null;
      }
    }
    return A;
  }
  function forwards(L, n, x) {  // L x = x
    for (let i = 0; i < n; i++) {
      let sum = x[i];
      for (let k = 0; k < i; k++) sum -= L[i * n + k] * x[k];
      x[i] = sum / L[i * n + i];
    }
    return x;
  }
  function backwards(L, n, x) {  // L^T x = x
    for (let i = n - 1; i >= 0; i--) {
      x[i] /= L[i * n + i];
      for (let k = 0; k < i; k++) x[k] -= L[i * n + k] * x[i];
    }
    return x;
  }
  function inverse(A, n) {
    const L = factor(Float64Array.from(A), n), out = new Float64Array(n * n);
    for (let i = 0; i < n; i++) {
      const row = out.subarray(i * n, (i + 1) * n);
      row[i] = 1;
      backwards(L, n, forwards(L, n, row));
    }
    return out;
  }
  function times(A, n, x) {
    const out = new Float64Array(n);
    for (let i = 0; i < n; i++) for (let j = 0; j < n; j++) out[i] += A[i * n + j] * x[j];
    return out;
  }

  // --- prior of the walkers ---------------------------------------------------------------------------------------

  const at = (joint, axis, block) => (joint * 3 + axis) * BLOCKS + block;

  // Coefficients of a walker by joint; if mirrored: sides exchanged, x negated, shifted by half a cycle.
  function byJoint(w, mirrored = false) {
    const out = new Float64Array(SIZE);
    for (let b = 0; b < BLOCKS; b++) for (let j = 0; j < JOINTS; j++) for (let x = 0; x < 3; x++) {
      const sign = mirrored && (x === 0) !== (b === 1 || b === 2) ? -1 : 1;
      out[at(mirrored ? SIDES[j] : j, x, b)] = sign * w[(b * JOINTS + j) * 3 + x];
    }
    return out;
  }

  // Vectors of a bone at the phases by axis, its lengths, and their mean.
  function measured(w, [start, end]) {
    const vectors = new Float64Array(3 * PHASES), lengths = new Float64Array(PHASES);
    let mean = 0;
    for (let k = 0; k < PHASES; k++) {
      let square = 0;
      for (let axis = 0; axis < 3; axis++) {
        let sum = 0;
        for (let b = 0; b < BLOCKS; b++) sum += BASIS[k * BLOCKS + b] * (w[at(end, axis, b)] - w[at(start, axis, b)]);
        vectors[axis * PHASES + k] = sum; square += sum * sum;
      }
      lengths[k] = Math.sqrt(square); mean += lengths[k] / PHASES;
    }
    return { vectors, lengths, mean };
  }

  // Mean, shrunken covariance and tolerances of bones, trained on all people but one.
  function learn(p, without) {
    const counts = new Map(), training = [];
    for (let r = 0; r < p.count; r++) {
      if (p.person[r] === p.person[without]) continue;
      training.push(r); counts.set(p.person[r], (counts.get(p.person[r]) ?? 0) + 1);
    }
    const rows = [], mean = new Float64Array(SIZE);
    let squares = 0;
    for (const r of training) {
      const weight = 1 / (counts.size * counts.get(p.person[r]));
      squares += weight * weight;
      for (const mirrored of [false, true]) rows.push({ w: byJoint(Gait.walker(p, r), mirrored), weight: weight / 2 });
    }
    for (const { w, weight } of rows) for (let i = 0; i < SIZE; i++) mean[i] += weight * w[i];
    const S = new Float64Array(SIZE * SIZE), off = new Float64Array(SIZE);
    for (const { w, weight } of rows) {
      const scaled = weight / (1 - squares);
      for (let i = 0; i < SIZE; i++) off[i] = w[i] - mean[i];
      for (let i = 0; i < SIZE; i++) {
        const factor = scaled * off[i];
        for (let j = 0, to = i * SIZE; j <= i; j++, to++) S[to] += factor * off[j];
      }
    }
    for (let i = 0; i < SIZE; i++) for (let j = 0; j < i; j++) S[j * SIZE + i] = S[i * SIZE + j];
    const { within, diagonal, extra } = SHRINKAGE, C = Float64Array.from(S, v => (1 - within - diagonal) * v);
    for (let i = 0; i < SIZE; i += BLOCKS) for (let j = 0; j < SIZE; j += BLOCKS) {
      const of = b => S[(i + b) * SIZE + j + b];
      [of(0), (of(1) + of(2)) / 2, (of(1) + of(2)) / 2, (of(3) + of(4)) / 2, (of(3) + of(4)) / 2]
        .forEach((v, b) => { C[(i + b) * SIZE + j + b] += within * v; });
    }
    for (let i = 0; i < SIZE; i++) C[i * SIZE + i] += diagonal * S[i * SIZE + i] + extra;
    const constancy = new Float64Array(BONES.length), symmetry = new Float64Array(PAIRS.length);
    for (const { w, weight } of rows) {
      const results = BONES.map(bone => measured(w, bone));
      results.forEach(({ lengths, mean: length }, b) => { for (const v of lengths) constancy[b] += weight * (v - length) ** 2 / PHASES; });
      PAIRS.forEach(([left, right], q) => { symmetry[q] += weight * (results[left].mean - results[right].mean) ** 2; });
    }
    return {
      mean, C, bones: constancy.map(v => 2 * HARMONICS / PHASES / (FACTORS.within ** 2 * v + MIN_VARIANCE)),
      pairs: symmetry.map(v => 1 / (FACTORS.pairs ** 2 * v + MIN_VARIANCE)),
    };
  }

  // --- one view --------------------------------------------------------------------------------------------------

  function turnedRows(w, angle) {  // across, up, away of x, y, z
    const c = Math.cos(angle), s = Math.sin(angle), out = new Float64Array(SIZE);
    for (let j = 0; j < JOINTS; j++) for (let b = 0; b < BLOCKS; b++) {
      const x = w[at(j, 0, b)], y = w[at(j, 1, b)];
      out[at(j, 0, b)] = c * x + s * y; out[at(j, 1, b)] = w[at(j, 2, b)]; out[at(j, 2, b)] = c * y - s * x;
    }
    return out;
  }
  function turned(prior, angle) {  // rows first, then columns
    const C = new Float64Array(SIZE * SIZE);
    for (let i = 0; i < SIZE; i++) C.set(turnedRows(prior.C.subarray(i * SIZE, (i + 1) * SIZE), angle), i * SIZE);
    const column = new Float64Array(SIZE);
    for (let j = 0; j < SIZE; j++) {
      for (let i = 0; i < SIZE; i++) column[i] = C[i * SIZE + j];
      turnedRows(column, angle).forEach((v, i) => { C[i * SIZE + j] = v; });
    }
    return { mean: turnedRows(prior.mean, angle), C };
  }

  // Mean of the unknown coefficients given the observed ones, and the inverse of their covariance.
  function condition({ mean, C }, walker, unknown, seen) {
    const O = seen.length, U = unknown.length, A = new Float64Array(O * O), expected = new Float64Array(U);
    for (let i = 0; i < O; i++) {
      for (let j = 0; j <= i; j++) A[i * O + j] = C[seen[i] * SIZE + seen[j]];
      A[i * O + i] += NOISE.variance + NOISE.share * A[i * O + i];
    }
    const L = factor(A, O), off = forwards(L, O, Float64Array.from(seen, i => walker[i] - mean[i]));
    const white = unknown.map(u => forwards(L, O, Float64Array.from(seen, i => C[u * SIZE + i])));
    const covariance = new Float64Array(U * U);
    for (let a = 0; a < U; a++) {
      expected[a] = mean[unknown[a]];
      for (let k = 0; k < O; k++) expected[a] += white[a][k] * off[k];
      for (let b = 0; b <= a; b++) {
        let sum = C[unknown[a] * SIZE + unknown[b]];
        for (let k = 0; k < O; k++) sum -= white[a][k] * white[b][k];
        covariance[a * U + b] = covariance[b * U + a] = sum;
      }
    }
    return { expected, precision: inverse(covariance, U) };
  }

  // Length terms of J.  With `add`, half their gradient and second derivatives are added to g and M: Gauss-Newton ones, or
  // exact ones with the curvature of lengths.
  function bones(prior, state, place, add = null) {
    const results = BONES.map(bone => measured(state, bone)), n = add?.g.length, slopes = [], pull = new Float64Array(BONES.length);
    let cost = 0;
    PAIRS.forEach(([left, right], q) => {
      const force = (results[left].mean - results[right].mean) * prior.pairs[q] / PHASES;
      pull[left] += force; pull[right] -= force;
    });
    BONES.forEach((bone, b) => {
      const { vectors, lengths, mean } = results[b], weight = prior.bones[b];
      for (const length of lengths) cost += weight * (length - mean) ** 2;
      if (!add) return;
      const entries = [];  // unknown coefficients of the bone's ends, with slopes of the length at every phase less their mean
      bone.forEach((joint, end) => {
        for (let axis = 0; axis < 3; axis++) for (let q = 0; q < BLOCKS && place[at(joint, axis, 0)] >= 0; q++) {
          const slope = new Float64Array(PHASES), sign = end ? 1 : -1;
          let middle = 0;
          for (let k = 0; k < PHASES; k++) {
            slope[k] = sign * vectors[axis * PHASES + k] / lengths[k] * BASIS[k * BLOCKS + q];
            middle += slope[k] / PHASES;
          }
          for (let k = 0; k < PHASES; k++) slope[k] -= middle;
          entries.push({ i: place[at(joint, axis, q)], slope, middle, axis, q, sign });
        }
      });
      entries.forEach((entry, p) => {
        for (let k = 0; k < PHASES; k++) add.g[entry.i] += weight * (lengths[k] - mean) * entry.slope[k];
        for (let o = 0; o <= p; o++) {
          const other = entries[o];
          let sum = 0, bent = 0;
          for (let k = 0; k < PHASES; k++) sum += entry.slope[k] * other.slope[k];
          for (let k = 0; k < PHASES && add.exact; k++) {
            const across = (entry.axis === other.axis) - vectors[entry.axis * PHASES + k] * vectors[other.axis * PHASES + k] / lengths[k] ** 2;
            bent += (weight * (lengths[k] - mean) + pull[b]) / lengths[k] * across * BASIS[k * BLOCKS + entry.q] * BASIS[k * BLOCKS + other.q];
          }
          sum = weight * sum + entry.sign * other.sign * bent;
          add.M[entry.i * n + other.i] += sum;
          if (o < p) add.M[other.i * n + entry.i] += sum;
        }
      });
      slopes[b] = entries;
    });
    PAIRS.forEach(([left, right], q) => {
      const off = results[left].mean - results[right].mean, weight = prior.pairs[q];
      cost += weight * off * off;
      if (!add) return;
      const lever = [...slopes[left].map(e => [e.i, e.middle]), ...slopes[right].map(e => [e.i, -e.middle])];
      for (const [i, v] of lever) {
        add.g[i] += weight * off * v;
        for (const [j, u] of lever) add.M[i * n + j] += weight * v * u;
      }
    });
    return cost;
  }

  // Most probable walker by Gauss-Newton steps, then Newton steps, each halved until J decreases; also the factor of the
  // inverse covariance of Laplace's approximation.
  function fit(prior, start, unknown, { expected, precision }) {
    const U = unknown.length, state = Float64Array.from(start), place = new Int32Array(SIZE).fill(-1);
    unknown.forEach((u, i) => { place[u] = i; state[u] = expected[i]; });
    const away = s => Float64Array.from(unknown, (u, i) => s[u] - expected[i]);
    const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
    const around = exact => {
      const off = away(state), g = times(precision, U, off), M = Float64Array.from(precision), pulled = dot(off, g);
      const cost = pulled + bones(prior, state, place, { g, M, exact });
      return { cost, g, L: factor(M, U) };
    };
    for (let n = 0; n < MAX_STEPS; n++) {
      const exact = n >= GAUSS_NEWTON_STEPS, first = around(exact), { cost, g, L } = first.L ? first : around(false);
      const step = backwards(L, U, forwards(L, U, g)), small = exact && step.every(v => Math.abs(v) < STEP_MM);
      let share = 1, falls = small;
      for (let half = 0; half < MAX_HALVINGS && !falls; half++, share /= falls ? 1 : 2) {
        const next = Float64Array.from(state);
        unknown.forEach((u, i) => { next[u] -= share * step[i]; });
        const moved = away(next), now = bones(prior, next, place) + dot(moved, times(precision, U, moved));
        falls = now <= cost * (1 + ROUNDING_TOLERANCE);
      }
      if (falls) unknown.forEach((u, i) => { state[u] -= share * step[i]; });
      if (small || !falls) break;
    }
    return { state, L: around(false).L };
  }

  // Reconstruction of a fold's walker from an angle: state, factor of the inverse covariance, and unknown coefficients.
  function view(f, angle) {
    f.anatomy ??= { prior: learn(f.people, f.r), views: new Map() };
    const views = f.anatomy.views, hidden = f.people.estimated?.[f.r];
    if (!views.has(angle)) {
      const walker = turnedRows(byJoint(f.walker), angle), unknown = [], seen = [];
      for (let i = 0; i < SIZE; i++) {
        const axis = Math.floor(i / BLOCKS) % 3, joint = Math.floor(i / (3 * BLOCKS));
        (axis === 2 || hidden?.[joint] ? unknown : seen).push(i);
      }
      const prior = f.anatomy.prior, conditional = condition(turned(prior, angle), walker, unknown, seen);
      views.set(angle, { ...fit(prior, walker, unknown, conditional), unknown });
    }
    return views.get(angle);
  }
  const missing = (f, angle) => awayOf(view(f, angle).state);
  function awayOf(state) {
    const out = new Float64Array(JOINTS * BLOCKS);
    for (let b = 0; b < BLOCKS; b++) for (let j = 0; j < JOINTS; j++) out[b * JOINTS + j] = state[at(j, 2, b)];
    return out;
  }

  // 95 % bars of the missing dimension at instants of the cycle: mean half width, mm, and share of the truth within them.
  function bars(f, angle) {
    const { L, state, unknown } = view(f, angle), U = unknown.length, real = turnedRows(byJoint(f.walker), angle);
    let half = 0, covered = 0, count = 0;
    for (let j = 0; j < JOINTS; j++) for (let k = 0; k < INSTANTS; k++) {
      if (f.people.estimated?.[f.r]?.[j]) continue;
      const row = new Float64Array(U), first = unknown.indexOf(at(j, 2, 0)), weights = basis(k / INSTANTS);
      let off = 0;
      weights.forEach((v, b) => { row[first + b] = v; off += v * (real[at(j, 2, b)] - state[at(j, 2, b)]); });
      const sd = Math.sqrt(forwards(L, U, row).reduce((sum, v) => sum + v * v, 0));
      half += NORMAL_95 * sd; count++;
      if (Math.abs(off) <= NORMAL_95 * sd) covered++;
    }
    return { half: half / count, covered: covered / count };
  }

  // Samples of the posterior of the missing dimension, the same at every call.
  function cloud(f, angle) {
    const result = view(f, angle), { L, state, unknown } = result, U = unknown.length;
    let seed = 2007;
    const uniform = () => { seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0; return (seed + 0.5) / 2 ** 32; };
    result.cloud ??= Array.from({ length: CLOUD }, () => {
      const z = Float64Array.from({ length: U }, () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform()));
      const drawn = Float64Array.from(state);
      backwards(L, U, z).forEach((v, i) => { drawn[unknown[i]] += v; });
      return awayOf(drawn);
    });
    return result.cloud;
  }

  function words(f, angle) {
    const { half, covered } = bars(f, angle);
    return `The method's 95 % bars are ±${half.toFixed(0)} mm on average and cover ${(100 * covered).toFixed(0)} % of this walker's depths `
      + `in this view, without calibration (zhang2007_coverage calibrates them on other people). Cloud: ${CLOUD} samples of the posterior.`;
  }

  Gait.METHODS.anatomical = {
    label: "anatomical (ours)", role: "green", prior: false, missing, cloud, words,
    step: { name: "+ bones", button: "Add the bones", words: "Bones keep their length, and left and right bones are equal. This step is our own, not the paper's." },
    note: "Anatomical is ours: mirror images, and bones of constant length, left and right alike. Here it has two harmonics and default settings, "
      + "like sweep.methods=[least_squares,map,anatomical]. zhang2007_structure has it with four harmonics.",
  };
  // Bars of one walker from one view, for the tests.
  Agreement.checks.push(async (people, tables, note) => {
    note(bars(Gait.fold(people, Math.floor(people.count / 2)), Math.PI / 6));
    return "";
  });
  return { learn, missing, bars, cloud };
})();
