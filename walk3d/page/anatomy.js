"use strict";
// The anatomical reconstruction of walk3d/anatomy/prior, for one walker at a time: the missing dimension given the
// flat view by a prior of mirrored, shrunken walks, then bones that keep their length, left and right alike.
//
// Coefficients are in the order (joint, axis, block), axes across, up and away; U of them are unknown.
const Anatomy = (() => {
  const { JOINTS, SIZE } = Gait, BLOCKS = 5, HARMONICS = 2, PHASES = 20, INSTANTS = 8, CLOUD = 12, NORMAL_95 = 1.959963984540054;
  const SHRINKAGE = { within: 0.2, diagonal: 0.1, extra: 20 }, NOISE = { variance: 100, share: 0.2 };
  const FACTORS = { within: 1.5, pairs: 2 }, LEAST_VARIANCE = 1;
  const GAUSS_NEWTON_STEPS = 3, STEP_MM = 1e-3, MOST_STEPS = 60, MOST_HALVINGS = 12, ROUNDING = 1e-12;
  const SIDES = [0, 1, 5, 6, 7, 2, 3, 4, 8, 12, 13, 14, 9, 10, 11];  // of a joint, the one on the other side
  const BONES = [...JSON.parse(document.getElementById("bones").textContent), [9, 12], [2, 5]];
  const named = bone => [...bone].sort((a, b) => a - b).join(), places = new Map(BONES.map((bone, b) => [named(bone), b]));
  const PAIRS = BONES.map((bone, b) => [b, places.get(named(bone.map(j => SIDES[j])))]).filter(([b, other]) => b < other);
  const BASIS = Float64Array.from({ length: PHASES * BLOCKS }, (_, i) => basis(Math.floor(i / BLOCKS) / PHASES)[i % BLOCKS]);

  function basis(cycle) {
    const t = 2 * Math.PI * cycle;
    return [1, Math.sin(t), Math.cos(t), Math.sin(2 * t), Math.cos(2 * t)];
  }

  // --- symmetric matrices, row by row --------------------------------------------------------------------------

  // The lower factor in place, null where there is none.
  function factor(A, n) {
    for (let i = 0; i < n; i++) {
      const own = A.subarray(i * n, i * n + i + 1);
      for (let j = 0; j <= i; j++) {
        const other = A.subarray(j * n, j * n + j + 1);
        let sum = own[j];
        for (let k = 0; k < j; k++) sum -= own[k] * other[k];
        if (j < i) own[j] = sum / other[j];
        else if (sum > 0) own[j] = Math.sqrt(sum);
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

  // --- what is known before the walker is seen ------------------------------------------------------------------

  const at = (joint, axis, block) => (joint * 3 + axis) * BLOCKS + block;

  // A walker's coefficients by joint; mirrored: sides exchanged, x negated, and half a cycle later.
  function byJoint(w, mirrored = false) {
    const out = new Float64Array(SIZE);
    for (let b = 0; b < BLOCKS; b++) for (let j = 0; j < JOINTS; j++) for (let x = 0; x < 3; x++) {
      const sign = mirrored && (x === 0) !== (b === 1 || b === 2) ? -1 : 1;
      out[at(mirrored ? SIDES[j] : j, x, b)] = sign * w[(b * JOINTS + j) * 3 + x];
    }
    return out;
  }

  // A bone at the phases: its ends apart along each axis, its lengths, and their mean.
  function measured(w, [one, other]) {
    const apart = new Float64Array(3 * PHASES), lengths = new Float64Array(PHASES);
    let mean = 0;
    for (let k = 0; k < PHASES; k++) {
      let square = 0;
      for (let axis = 0; axis < 3; axis++) {
        let sum = 0;
        for (let b = 0; b < BLOCKS; b++) sum += BASIS[k * BLOCKS + b] * (w[at(other, axis, b)] - w[at(one, axis, b)]);
        apart[axis * PHASES + k] = sum; square += sum * sum;
      }
      lengths[k] = Math.sqrt(square); mean += lengths[k] / PHASES;
    }
    return { apart, lengths, mean };
  }

  // Mean, shrunken covariance and tolerances of bones, of everyone but one person.
  function learn(p, without) {
    const counts = new Map(), kept = [];
    for (let r = 0; r < p.count; r++) {
      if (p.person[r] === p.person[without]) continue;
      kept.push(r); counts.set(p.person[r], (counts.get(p.person[r]) ?? 0) + 1);
    }
    const rows = [], mean = new Float64Array(SIZE);
    let squares = 0;
    for (const r of kept) {
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
        const here = scaled * off[i];
        for (let j = 0, to = i * SIZE; j <= i; j++, to++) S[to] += here * off[j];
      }
    }
    for (let i = 0; i < SIZE; i++) for (let j = 0; j < i; j++) S[j * SIZE + i] = S[i * SIZE + j];
    const { within, diagonal, extra } = SHRINKAGE, C = Float64Array.from(S, v => (1 - within - diagonal) * v);
    for (let i = 0; i < SIZE; i += BLOCKS) for (let j = 0; j < SIZE; j += BLOCKS) {
      const one = b => S[(i + b) * SIZE + j + b];
      [one(0), (one(1) + one(2)) / 2, (one(1) + one(2)) / 2, (one(3) + one(4)) / 2, (one(3) + one(4)) / 2]
        .forEach((v, b) => { C[(i + b) * SIZE + j + b] += within * v; });
    }
    for (let i = 0; i < SIZE; i++) C[i * SIZE + i] += diagonal * S[i * SIZE + i] + extra;
    const constancy = new Float64Array(BONES.length), symmetry = new Float64Array(PAIRS.length);
    for (const { w, weight } of rows) {
      const found = BONES.map(bone => measured(w, bone));
      found.forEach(({ lengths, mean: length }, b) => { for (const v of lengths) constancy[b] += weight * (v - length) ** 2 / PHASES; });
      PAIRS.forEach(([one, other], q) => { symmetry[q] += weight * (found[one].mean - found[other].mean) ** 2; });
    }
    return {
      mean, C, bones: constancy.map(v => 2 * HARMONICS / PHASES / (FACTORS.within ** 2 * v + LEAST_VARIANCE)),
      pairs: symmetry.map(v => 1 / (FACTORS.pairs ** 2 * v + LEAST_VARIANCE)),
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
  function turned(prior, angle) {  // a column after the other, then a row
    const C = new Float64Array(SIZE * SIZE);
    for (let i = 0; i < SIZE; i++) C.set(turnedRows(prior.C.subarray(i * SIZE, (i + 1) * SIZE), angle), i * SIZE);
    const column = new Float64Array(SIZE);
    for (let j = 0; j < SIZE; j++) {
      for (let i = 0; i < SIZE; i++) column[i] = C[i * SIZE + j];
      turnedRows(column, angle).forEach((v, i) => { C[i * SIZE + j] = v; });
    }
    return { mean: turnedRows(prior.mean, angle), C };
  }

  // Mean of the unknown given the observed coefficients, and the inverse of its covariance.
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

  // Length terms of J; with `add`, half their gradient and their matrix are added to g and M: that of Gauss and Newton,
  // or the exact one, with the curvature of lengths.
  function bones(prior, state, place, add = null) {
    const found = BONES.map(bone => measured(state, bone)), n = add?.g.length, slopes = [], pull = new Float64Array(BONES.length);
    let cost = 0;
    PAIRS.forEach(([left, right], q) => {
      const force = (found[left].mean - found[right].mean) * prior.pairs[q] / PHASES;
      pull[left] += force; pull[right] -= force;
    });
    BONES.forEach((bone, b) => {
      const { apart, lengths, mean } = found[b], weight = prior.bones[b];
      for (const length of lengths) cost += weight * (length - mean) ** 2;
      if (!add) return;
      const entries = [];  // unknown coefficients of its ends, with the slope of its length at every phase less the mean
      bone.forEach((joint, end) => {
        for (let axis = 0; axis < 3; axis++) for (let q = 0; q < BLOCKS && place[at(joint, axis, 0)] >= 0; q++) {
          const slope = new Float64Array(PHASES), sign = end ? 1 : -1;
          let middle = 0;
          for (let k = 0; k < PHASES; k++) {
            slope[k] = sign * apart[axis * PHASES + k] / lengths[k] * BASIS[k * BLOCKS + q];
            middle += slope[k] / PHASES;
          }
          for (let k = 0; k < PHASES; k++) slope[k] -= middle;
          entries.push({ i: place[at(joint, axis, q)], slope, middle, axis, q, sign });
        }
      });
      entries.forEach((one, p) => {
        for (let k = 0; k < PHASES; k++) add.g[one.i] += weight * (lengths[k] - mean) * one.slope[k];
        for (let o = 0; o <= p; o++) {
          const other = entries[o];
          let sum = 0, bent = 0;
          for (let k = 0; k < PHASES; k++) sum += one.slope[k] * other.slope[k];
          for (let k = 0; k < PHASES && add.exact; k++) {
            const across = (one.axis === other.axis) - apart[one.axis * PHASES + k] * apart[other.axis * PHASES + k] / lengths[k] ** 2;
            bent += (weight * (lengths[k] - mean) + pull[b]) / lengths[k] * across * BASIS[k * BLOCKS + one.q] * BASIS[k * BLOCKS + other.q];
          }
          sum = weight * sum + one.sign * other.sign * bent;
          add.M[one.i * n + other.i] += sum;
          if (o < p) add.M[other.i * n + one.i] += sum;
        }
      });
      slopes[b] = entries;
    });
    PAIRS.forEach(([left, right], q) => {
      const off = found[left].mean - found[right].mean, weight = prior.pairs[q];
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

  // The most probable walker by some steps of Gauss and Newton, then Newton's, each halved until J falls, and the factor
  // of the inverse covariance of Laplace's approximation.
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
    for (let n = 0; n < MOST_STEPS; n++) {
      const exact = n >= GAUSS_NEWTON_STEPS, first = around(exact), { cost, g, L } = first.L ? first : around(false);
      const step = backwards(L, U, forwards(L, U, g)), small = exact && step.every(v => Math.abs(v) < STEP_MM);
      let share = 1, falls = small;
      for (let half = 0; half < MOST_HALVINGS && !falls; half++, share /= falls ? 1 : 2) {
        const next = Float64Array.from(state);
        unknown.forEach((u, i) => { next[u] -= share * step[i]; });
        const there = away(next), now = bones(prior, next, place) + dot(there, times(precision, U, there));
        falls = now <= cost * (1 + ROUNDING);
      }
      if (falls) unknown.forEach((u, i) => { state[u] -= share * step[i]; });
      if (small || !falls) break;
    }
    return { state, L: around(false).L };
  }

  // A walker of a fold seen from an angle: missing dimension (5 x 15), its factor, and which coefficients are unknown.
  function view(f, angle) {
    f.anatomy ??= { prior: learn(f.people, f.r), views: new Map() };
    const known = f.anatomy.views, hidden = f.people.estimated?.[f.r];
    if (!known.has(angle)) {
      const walker = turnedRows(byJoint(f.walker), angle), unknown = [], seen = [];
      for (let i = 0; i < SIZE; i++) {
        const axis = Math.floor(i / BLOCKS) % 3, joint = Math.floor(i / (3 * BLOCKS));
        (axis === 2 || hidden?.[joint] ? unknown : seen).push(i);
      }
      const prior = f.anatomy.prior, given = condition(turned(prior, angle), walker, unknown, seen);
      known.set(angle, { ...fit(prior, walker, unknown, given), unknown });
    }
    return known.get(angle);
  }
  const missing = (f, angle) => awayOf(view(f, angle).state);
  function awayOf(state) {
    const out = new Float64Array(JOINTS * BLOCKS);
    for (let b = 0; b < BLOCKS; b++) for (let j = 0; j < JOINTS; j++) out[b * JOINTS + j] = state[at(j, 2, b)];
    return out;
  }

  // Bars of 95 % of the missing dimension at instants of the cycle: mean half width, mm, and the share that they cover.
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

  // Draws from the posterior of the missing dimension, the same at every call.
  function cloud(f, angle) {
    const found = view(f, angle), { L, state, unknown } = found, U = unknown.length;
    let seed = 2007;
    const uniform = () => { seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0; return (seed + 0.5) / 2 ** 32; };
    found.cloud ??= Array.from({ length: CLOUD }, () => {
      const z = Float64Array.from({ length: U }, () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform()));
      const drawn = Float64Array.from(state);
      backwards(L, U, z).forEach((v, i) => { drawn[unknown[i]] += v; });
      return awayOf(drawn);
    });
    return found.cloud;
  }

  function words(f, angle) {
    const { half, covered } = bars(f, angle);
    return `Its own 95 % bars reach ±${half.toFixed(0)} mm on average and hold ${(100 * covered).toFixed(0)} % of this walker's depths `
      + `from here, as computed (zhang2007_coverage calibrates them on other people). The cloud: ${CLOUD} draws from the posterior.`;
  }

  Gait.METHODS.anatomical = {
    label: "anatomical (ours)", role: "green", prior: false, missing, cloud, words,
    step: { name: "+ bones", button: "Add the bones", words: "Bones keep their length, left and right alike. This part is ours, not the paper's." },
    note: "Anatomical is ours: mirror images, bones of constant length, left and right alike; here with two harmonics and settings that are the same for all, "
      + "as sweep.methods=[least_squares,map,anatomical] gives it. zhang2007_structure has it with four harmonics.",
  };
  // The bars of one walker from one view, against which tests compare.
  Agreement.checks.push(async (people, tables, note) => {
    note(bars(Gait.fold(people, Math.floor(people.count / 2)), Math.PI / 6));
    return "";
  });
  return { learn, missing, bars, cloud };
})();
