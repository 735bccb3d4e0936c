"use strict";
// First screen: guess the depth of a hand, then see what each method reconstructs, then turn the camera.
const Experiment = (() => {
  const id = name => document.getElementById(name), rad = degrees => degrees * Math.PI / 180;
  const HAND = 7, INSTANT = 0.2, SLICE_MS = 8;
  // Steps with the text of the button that leads to each one; methods of plug-ins follow those of the paper.
  const added = () => Object.entries(Gait.METHODS).filter(([, method]) => method.step);
  const stepsOf = () => [
    { words: "Fifteen dots walk away from one camera. The image is flat: their depth is lost. Is the right hand nearer than the body or farther? Drag it in the view from the side: the dots then stop.", method: null },
    { button: "Show where it is", words: "", method: null },
    { button: "Least squares", words: "Least squares: people differ along a few directions, the eigenwalkers. Their sum that fits the flat picture best is the reconstruction.", method: "least_squares" },
    { button: "Add the prior", words: "The prior: the same fit, with a penalty on unusual walks. Noise is no longer mistaken for an unusual gait.", method: "map" },
    ...added().map(([method, { step: { button, words } }]) => ({ button, words, method })),
    { button: "Turn the camera", words: "Turn the camera: all methods solve again. From the side almost no depth is lost; from the front or from behind, most of it is.", method: added().at(-1)?.[0] ?? "map" },
  ];
  const namesOf = () => ({ baseline: "average walker", least_squares: "least squares", map: "+ prior",
    ...Object.fromEntries(added().map(([key, { step }]) => [key, step.name])) });

  // Depth errors, means over all walkers as in the tables, by method, view and number of eigenwalkers.  They are computed
  // in slices of a frame, cached, and reported when they are complete.  A new request ends the previous one.
  const cache = new Map();
  function sampler(people) {
    let latest = 0;
    const mean = list => list.reduce((sum, v) => sum + v, 0) / list.length;
    return (requests, report) => {
      const ours = ++latest, left = [];
      for (const request of requests) {
        if (!cache.has(request.join())) cache.set(request.join(), []);
        for (let q = cache.get(request.join()).length; q < people.count; q++) left.push([request, q]);
      }
      const some = () => {
        if (ours !== latest) return;
        for (const began = performance.now(); left.length && performance.now() - began < SLICE_MS;) {
          const [[key, degrees, n], q] = left.shift(), list = cache.get([key, degrees, n].join()), angle = rad(degrees);
          if (list.length === q) list.push(Gait.errors(people, q, Gait.reconstruct(Gait.fold(people, q), key, n, angle, people.sigma2_mm2).delta, angle).rms);
        }
        for (const request of requests) { const list = cache.get(request.join()); report(list.length === people.count ? mean(list) : null, request); }
        if (left.length) requestAnimationFrame(some);
      };
      some();
    };
  }

  // Sentence with sliders for two of its numbers.
  function sentence(people) {
    const count = id("alive-count"), view = id("alive-view"), out = id("alive-errors");
    if (!count) return;
    const run = sampler(people), words = { least_squares: "by least squares", map: "with the prior", baseline: "by the average walker" };
    count.max = Math.min(60, people.count - 2); count.value = people.components;
    const update = () => {
      const n = +count.value, degrees = +view.value, errors = {};
      id("alive-count-now").textContent = n; id("alive-view-now").textContent = Players.heading(degrees);
      view.setAttribute("aria-valuetext", Players.heading(degrees));
      run(Object.keys(words).map(key => [key, degrees, n]), (error, [key]) => {
        errors[key] = error;
        const complete = Object.keys(words).every(name => errors[name]);
        out.textContent = complete ? `${Object.entries(words).map(([name, by]) => `${errors[name].toFixed(1)} mm ${by}`).join(", ")}.` : "computing";
      });
    };
    const visible = new IntersectionObserver(([entry]) => { if (entry.isIntersecting) { visible.disconnect(); update(); } });
    visible.observe(out);
    for (const control of [count, view]) control.addEventListener("input", update);
  }

  function start(people) {
    if (!id("experiment")) return;
    const STEPS = stepsOf(), NAMES = namesOf();
    const { Stage, drag, ink, loop, still, heading } = Players;
    const flat = new Stage(id("flat"), 2150, [0, -60]), aside = new Stage(id("aside"), 2150, [0, -60]);
    flat.wide = aside.wide = 1300;
    const guess = id("guess"), view = id("turned-view"), state = { step: 0, angle: 0 }, playing = { on: false };
    const r = people.shown, walker = Gait.walker(people, r), say = mm => `${Math.abs(mm).toFixed(0)} mm ${mm > 0 ? "farther" : "nearer"}`;
    const axes = angle => [Math.cos(angle), Math.sin(angle)];
    const depth = (p, j, [c, s]) => -s * p[3 * j] + c * p[3 * j + 1], across = (p, j, [c, s]) => c * p[3 * j] + s * p[3 * j + 1];

    const bars = new Map(), box = id("means"), run = sampler(people);
    for (const [key, name] of Object.entries(NAMES)) {
      const row = box.appendChild(document.createElement("div")), bar = document.createElement("i"), out = document.createElement("span");
      row.append(Object.assign(document.createElement("span"), { textContent: name }), bar, out);
      bar.style.setProperty("--ink", `var(--c-${Charts.roles(Gait.METHODS[key].role)})`);
      bars.set(key, { row, bar, out });
    }
    function means() {
      for (const [key, { row }] of bars) row.hidden = state.step < Math.max(2, STEPS.findIndex(step => step.method === key));
      run([...bars].filter(([, { row }]) => !row.hidden).map(([key]) => [key, +view.value, people.components]), (error, [key]) => {
        const { bar, out } = bars.get(key);
        bar.style.width = `${Math.min(100, 2 * error)}%`;
        out.textContent = error ? `${error.toFixed(1)} mm` : "computing";
      });
    }
    function solve() {
      state.angle = rad(+view.value);
      const method = STEPS[state.step].method;
      state.found = method ? Gait.combine(walker, Gait.reconstruct(Gait.fold(people, r), method, people.components, state.angle, people.sigma2_mm2).missing, state.angle) : null;
      state.colour = method ? Charts.roles(Gait.METHODS[method].role) : "blue";
      id("turned-view-now").textContent = heading(+view.value);
      view.setAttribute("aria-valuetext", heading(+view.value));
      means();
    }
    const now = () => INSTANT + entry.clock * people.frequency_hz[r];
    const truthDepth = () => { const p = Gait.posture(walker, now()); return depth(p, HAND, axes(0)) - depth(p, 8, axes(0)); };
    function guessed() {
      id("guess-now").textContent = +guess.value === 0 ? "the same as the body" : say(+guess.value);
      guess.setAttribute("aria-valuetext", id("guess-now").textContent);
    }
    function to(step) {
      state.step = Math.max(0, Math.min(STEPS.length - 1, step));
      const last = state.step === STEPS.length - 1;
      if (!last) view.value = 0;
      playing.on = state.step !== 1 && !still;
      id("step-number").textContent = `${state.step + 1} of ${STEPS.length}`;
      const off = +guess.value - truthDepth();
      id("step-words").textContent = state.step === 1
        ? `It is ${say(truthDepth())} than the middle of the body; your guess is ${Math.abs(off).toFixed(0)} mm off. The picture alone does not show this depth. The next steps learn it from the walks of ${people.count - 1} other people.`
        : STEPS[state.step].words;
      id("guess-row").hidden = state.step > 0; id("view-row").hidden = !last;
      id("step-next").textContent = last ? "Again" : STEPS[state.step + 1].button;
      id("step-back").disabled = state.step === 0;
      id("aside-words").textContent = state.step === 0 ? "the same from the side: the camera is on the left, depth runs to the right" : "from the side; dashed: the real walk" + (state.step > 1 ? "; in colour: the reconstruction from the dots" : "");
      solve();
    }
    id("step-next").addEventListener("click", () => { to(state.step === STEPS.length - 1 ? 0 : state.step + 1); });
    id("step-back").addEventListener("click", () => to(state.step - 1));
    guess.addEventListener("input", () => { playing.on = false; guessed(); });
    view.addEventListener("input", solve);
    drag(aside.canvas, dx => { if (state.step === 0) { guess.value = +guess.value + dx / aside.scale; guessed(); } }, () => { if (state.step === 0) playing.on = false; });
    drag(flat.canvas, dx => { if (state.step === STEPS.length - 1) { view.value = +view.value + dx * 0.5; solve(); } });

    function draw() {
      const cycle = now(), real = Gait.posture(walker, cycle), at = axes(state.angle);
      const colour = ink(`--c-${state.colour}`), text = ink("--text"), grey = ink("--truth"), middle = depth(real, 8, at);
      flat.begin();
      for (let j = 0; j < 15; j++) flat.dot(flat.place(across(real, j, at), real[3 * j + 2]), j === HAND && state.step < 2 ? 8 : 5, j === HAND && state.step < 2 ? ink("--bad") : text);
      aside.begin();
      const flatten = p => Float64Array.from({ length: 45 }, (_, i) => i % 3 === 0 ? depth(p, Math.floor(i / 3), at) - middle : p[i]), project = (x, y, z) => aside.place(x, z);
      const [cx, cy] = aside.place(-560, real[3 * HAND + 2] + (state.step ? 300 : 0));
      aside.line([[cx - 9, cy - 8], [cx + 9, cy], [cx - 9, cy + 8], [cx - 9, cy - 8]], ink("--accent"), 2);
      if (state.step === 0) {
        for (let j = 0; j < 15; j++) if (j !== HAND) aside.dot(aside.place(0, real[3 * j + 2]), 3.2, grey);
        const z = real[3 * HAND + 2], hand = aside.place(+guess.value, z);
        aside.line([aside.place(-540, z), aside.place(600, z)], ink("--accent"), 1.2, [5, 5]);
        aside.line([[hand[0] - 16, hand[1]], [hand[0] + 16, hand[1]]], ink("--bad"), 2);
        aside.dot(hand, 9, ink("--bad"));
        return;
      }
      const truth = flatten(real);
      aside.skeleton(truth, project, grey, { width: 3, radius: 2.5, dash: [6, 5] });
      if (state.step === 1) {
        const z = real[3 * HAND + 2];
        aside.line([aside.place(+guess.value, z), aside.place(truth[3 * HAND], z)], ink("--bad"), 2);
        aside.dot(aside.place(+guess.value, z), 8, ink("--bad"), true); aside.dot(aside.place(truth[3 * HAND], z), 6, ink("--bad"));
      } else if (state.found) {
        const result = flatten(Gait.posture(state.found, cycle));
        for (let j = 0; j < 15; j++) aside.line([aside.place(truth[3 * j], truth[3 * j + 2]), aside.place(result[3 * j], result[3 * j + 2])], ink("--bad"), 1);
        aside.skeleton(result, project, colour, { width: 3, radius: 3.4 });
      }
    }
    const entry = loop(playing, [flat, aside], draw);
    guessed(); to(0);
  }
  return { start, sentence };
})();
