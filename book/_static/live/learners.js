// The live figure of ES and GES on the robot: choose alpha, the decay and the seed, and train both side by side.
//
// What can be moved is `given`: { alpha, decay, seed }; whatever moves it, training begins anew.
(() => {
  "use strict";

  const {
    add, set, plane, chart, key, trace, slices, solver, normal, learner, sideBySide,
    parts: shared, words: { learners: words, parts: { sliders: meanings } },
  } = window.nmpcrl;
  const GAUGE = 4; // its end
  const LOWEST = 0.97; // of the axis of costs, times the least of all
  const HIGHER = 1.02, HIGHEST = 1.3; // the range of its end, times the cost of theta_init
  const LEVEL = { color: "var(--quiet)", dashes: "2 2" };
  const still = matchMedia("(prefers-reduced-motion: reduce)");

  // ---- What is chosen

  function settings(parent, { decays, seeds, alphas }, move) {
    const row = add(parent, "div", { class: "choices" });
    const choice = (name, options, read) => {
      const line = add(row, "label", { class: "choice" });
      add(line, "span", {}, words.choices[name]);
      const select = add(line, "select");
      for (const value of options) add(select, "option", { value }, words.option(value));
      select.addEventListener("change", () => move({ [name]: read(select.value) }));
      return (given) => { select.value = given[name]; };
    };
    const decay = choice("decay", decays, String), seed = choice("seed", seeds, Number);
    const alpha = shared.slider(add(row, "div", { class: "long" }), {
      name: "alpha", label: words.alpha, range: alphas, text: (power) => words.size(10 ** power),
    }, {
      read: (given) => Math.log10(given.alpha),
      write: (power) => move({ alpha: Number((10 ** power).toPrecision(3)) }),
    });
    return (given) => {
      decay(given);
      seed(given);
      alpha(given);
    };
  }

  // ---- What is shown

  function map(figure, data) {
    const ground = plane(figure, data.view, words.map);
    shared.background(ground, data);
    data.problem.discs.forEach(([cx, cy, clearance], k) => {
      add(ground.ground, "circle", { class: "safety", cx, cy, r: clearance / 2 });
      add(ground.ground, "circle", { class: "disc", cx, cy, r: data.radii[k] });
    });
    const [x, y] = data.problem.target;
    add(ground.ground, "circle", { class: "target", cx: x, cy: y });
    ground.write(words.target, x, y, { class: "name" });
    const drawn = add(ground.ground, "g");
    return (found, policies) => {
      drawn.replaceChildren();
      trace(drawn, "polyline", { points: shared.points(found[0].costs[0].states) }, data.looks.frozen);
      found.forEach((now, k) => {
        const look = data.looks[now.learner];
        trace(drawn, "polyline", { points: shared.points(policies[k]) }, look);
        if (!now.step) return;
        const [cx, cy] = now.step.state;
        trace(drawn, "circle", { cx, cy, r: data.robot }, { ...look, dashes: "" });
      });
    };
  }

  // alpha ||phi||^2 of this step, and whether it is too large.
  function gauge(parent, name, { overshoot, looks }) {
    const line = add(parent, "div", { class: "gauge" });
    key(add(line, "span", { class: "key" }), name, looks[name]);
    const meter = add(line, "div", {
      class: "meter", role: "meter", "aria-label": words.gauge(name), "aria-valuemin": 0, "aria-valuemax": GAUGE,
    });
    const bar = add(meter, "div"), mark = add(meter, "span");
    mark.style.left = `${(100 * overshoot) / GAUGE}%`;
    const value = add(line, "span", { class: "value" });
    return ({ gauge: now }) => {
      const known = Number.isFinite(now);
      bar.style.width = `${known ? Math.min(100, (100 * now) / GAUGE) : 0}%`;
      meter.classList.toggle("above", known && now > overshoot);
      value.textContent = words.gauged(now, overshoot);
      set(meter, { "aria-valuenow": known ? Math.min(now, GAUGE) : 0, "aria-valuetext": value.textContent });
    };
  }

  function gauges(parent, data) {
    add(parent, "p", { class: "legend" }, words.gauges(data.overshoot));
    const all = Object.keys(data.settings).map((name) => gauge(parent, name, data));
    return (found) => all.forEach((draw, k) => draw(found[k]));
  }

  // A component of theta: a bar for each learner, and a mark where it began.
  function weight(parent, data, name, k) {
    const whole = add(parent, "div", { class: "weight", role: "group", "aria-label": meanings[name] });
    shared.symbol(whole, name);
    const bars = Object.keys(data.settings).map((one) => {
      const line = add(whole, "div");
      const bar = add(line, "div"), mark = add(line, "span"), value = add(whole, "span", { class: "value" });
      bar.style.setProperty("--learner", data.looks[one].color);
      return { bar, mark, value };
    });
    return (found) => {
      const first = found[0].costs[0].theta[k], numbers = found.map(({ theta }) => theta[k]);
      const least = Math.min(0, ...numbers), most = Math.max(2 * first, ...numbers);
      const share = (number) => (100 * (number - least)) / (most - least);
      found.forEach(({ theta }, i) => {
        const [low, high] = [share(Math.min(0, theta[k])), share(Math.max(0, theta[k]))];
        Object.assign(bars[i].bar.style, { left: `${low}%`, width: `${high - low}%` });
        bars[i].mark.style.left = `${share(first)}%`;
        bars[i].value.textContent = words.weight(theta[k]);
      });
    };
  }

  function weights(parent, data) {
    add(parent, "p", { class: "legend" }, words.weights);
    const row = add(parent, "div", { class: "weights" });
    const all = data.names.map((name, k) => weight(row, data, name, k));
    return (found) => all.forEach((draw) => draw(found));
  }

  function charts(parent, data) {
    const { episodes, evaluateEvery: every } = data.settings.ES, { looks, overshoot } = data;
    const row = add(parent, "div", { class: "costs" });
    const [costs, gauges] = ["costs", "gauges"].map((name) => {
      const label = words.charts[name]({ every, overshoot });
      const one = chart(row, { label, last: episodes });
      one.title.textContent = label;
      return one;
    });
    const across = (y) => [[0, y], [episodes, y]];
    return (found) => {
      const all = found.flatMap((now) => now.costs.map(({ cost }) => cost)), first = all[0];
      const lines = found.map((now) => ({
        look: looks[now.learner], points: now.costs.map(({ episode, cost }) => [episode, cost]),
      }));
      const highest = Math.max(HIGHER * first, ...all.filter(Number.isFinite));
      const range = [LOWEST * Math.min(...all), Math.min(HIGHEST * first, highest)];
      costs.draw([{ points: across(first), look: looks.frozen }, ...lines], range, words.cost);
      const largest = found.map((now) => ({
        look: looks[now.learner], points: now.gauges.map((number, k) => [k + 1, number]),
      }));
      gauges.draw([{ points: across(overshoot), look: LEVEL }, ...largest], [0, GAUGE], words.cost);
    };
  }

  function keys(parent, { looks }) {
    const line = add(parent, "p", { class: "key" });
    for (const [name, look] of Object.entries(looks)) key(line, words.names[name], look);
  }

  // ---- The figure

  async function build(figure, data, nmpc) {
    const own = await Promise.all(Object.keys(data.settings).map(() => solver(window.nmpcrl.module, data.problem)));
    const { episodes, steps } = data.settings.ES;
    const judge = (theta) => {
      const { start, target, discs, horizon } = data.settings.ES;
      const { states, cost, failed } = nmpc.rollout({ start, target, discs, horizon, theta }, steps);
      return { theta, states, cost: failed ? Infinity : cost };
    };
    let begun = null; // both learners, from what was given

    function anew(given) {
      const { deviation, widths } = data.noise;
      const noise = normal(given.seed, episodes * steps * data.problem.lower.length, widths);
      const scaled = noise.map((number) => deviation * number);
      begun = sideBySide(Object.values(data.settings).map(
        (settings, k) => learner(own[k], { ...settings, ...given }, scaled, judge),
      ));
    }

    const { read, move } = shared.state(data.given, (given) => {
      training.stop();
      anew(given);
      show();
    });
    shared.heading(figure, words);
    const chosen = settings(figure, data, move);
    const row = add(figure, "div", { class: "buttons" });
    const press = (name, act) => {
      const made = add(row, "button", { type: "button" }, words.buttons[name]);
      made.addEventListener("click", act);
      return made;
    };
    const train = press("train", () => (training.running() ? training.stop() : training.begin()));
    const some = ["wholeEpisode", "step"].map((name) => press(name, () => {
      training.stop();
      if (!begun.over()) begun[name]();
      show();
    }));
    press("reset", () => move(data.given));
    const line = add(row, "label", { class: "done" });
    const bar = add(line, "progress", { max: episodes, "aria-label": words.progress }), count = add(line, "span");
    keys(figure, data);
    const sides = add(figure, "div", { class: "sides" });
    const places = map(add(sides, "div"), data), numbers = add(sides, "div");
    const parts = [gauges(numbers, data), weights(numbers, data), charts(figure, data)];
    add(figure, "p", { class: "legend" }, words.legend(data.settings.ES));
    const say = shared.results(figure);

    const training = slices({
      work: () => !begun.over() && begun.step(),
      pause: () => (still.matches ? progress() : show()),
      rest: () => show(),
    });

    function progress() {
      const done = Math.max(...begun.all.map(({ episode }) => episode));
      bar.value = done;
      count.textContent = words.done(done, episodes);
      train.textContent = words.buttons[training.running() ? "stop" : "train"];
    }

    function show() {
      const found = begun.all, running = training.running();
      progress();
      chosen(read());
      // while it trains, the policies last judged; then those of the weights now
      const policies = found.map(({ theta, costs }) => (running ? costs.at(-1) : judge(theta)).states);
      for (const draw of parts) draw(found);
      places(found, policies);
      for (const button of [train, ...some]) button.disabled = begun.over();
      say(found.map(words.result));
      figure.shown = { given: read(), found }; // for whoever asks; tests do
    }
    anew(data.given);
    show();
  }

  shared.begin("learners", build);
})();
