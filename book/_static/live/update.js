// The live figure of one update: each number of a step of Expected Sarsa, and how far the step goes.
(() => {
  "use strict";

  const { add, set, slider, parts: shared, words: { update: words } } = window.nmpcrl;
  const { clamp } = shared;
  const EXPONENTS = [-9, -5, 0.05]; // of alpha
  const NOISE = [-2, 2, 0.1]; // standard deviations
  const UNIT = 100, MOST = 3; // of the gauge; what is beyond stands at its end

  // Every number of the update, in the order in which they are found; it ends where a solve fails.
  function update(nmpc, data, { state, theta, noise, alpha }) {
    const { problem: { discs, lower, upper }, horizon, gamma } = data, { rules } = nmpc;
    const ask = (where, weights) => ({ state: where, theta: weights, discs, horizon });
    const plan = nmpc.solve(ask(state, theta));
    if (!plan) return {};
    const action = plan.action.map((each, k) => clamp(each + noise[k], lower[k], upper[k]));
    const cost = nmpc.cost({ discs }, state, action);
    const next = nmpc.step(state, action);
    const following = nmpc.solve(ask(next, theta), { warm: plan });
    if (!following) return { plan, action, cost, next };
    const delta = rules.tdError(cost, gamma, plan.value, following.value);
    const moved = rules.semiGradient(theta, delta, plan.features, alpha);
    const again = moved.every(Number.isFinite) ? nmpc.solve(ask(state, moved)) : null;
    const pull = alpha * plan.features.reduce((sum, each) => sum + each ** 2, 0);
    const closed = again && (again.value - plan.value) / delta;
    return { plan, action, cost, next, following, delta, moved, again, pull, closed };
  }

  // Two independent numbers of the standard normal distribution (Box and Muller, 1958).
  function normal() {
    const length = Math.sqrt(-2 * Math.log(1 - Math.random())), angle = 2 * Math.PI * Math.random();
    return [length * Math.cos(angle), length * Math.sin(angle)];
  }

  function sliders(parent, read, move) {
    const row = add(parent, "div", { class: "wide" });
    const noises = ["epsilon_v", "epsilon_nu"].map((name, k) => (
      slider(row, { name, label: words.noise[k], range: NOISE, text: words.deviations }, {
        read: ({ noise }) => noise[k],
        write: (number) => move({ noise: read().noise.with(k, number) }),
      })
    ));
    const alpha = slider(row, { name: "alpha", label: words.alpha, range: EXPONENTS, text: words.power }, {
      read: (given) => Math.log10(given.alpha),
      write: (exponent) => move({ alpha: 10 ** exponent }),
    });
    return (given) => [...noises, alpha].forEach((draw) => draw(given));
  }

  // The steps of the update, one under the other.
  function steps(parent) {
    const list = add(parent, "ol", { class: "steps" });
    return (given, found) => {
      list.replaceChildren();
      for (const texts of words.steps(given, found)) {
        const line = add(list, "li");
        texts.forEach((text, k) => shared.write(k % 2 ? add(line, "b") : line, text));
      }
    };
  }

  // From the value, at 0, to its target, at 1: where the step leads, to first order and in truth.
  function gauge(parent, { overshoot }) {
    const svg = add(parent, "svg", {
      class: "scale", viewBox: "-35 -28 370 66", role: "img", "aria-label": words.gauge,
    });
    add(svg, "rect", { class: "beyond", x: UNIT * overshoot, y: -12, width: UNIT * (MOST - overshoot) + 30, height: 24 });
    add(svg, "line", { class: "grid", x1: -30, x2: UNIT * MOST + 30, y1: 0, y2: 0 });
    words.places.forEach((text, at) => {
      add(svg, "line", { class: "grid", x1: UNIT * at, x2: UNIT * at, y1: -12, y2: 12 });
      add(svg, "text", { x: UNIT * at, y: 33 }, text);
    });
    const marks = ["first", "true"].map((kind) => add(svg, "path", { class: `mark ${kind}` }));
    return (_, { pull, closed }) => {
      [pull, closed].forEach((share, k) => {
        const known = share !== undefined && share !== null;
        const at = UNIT * clamp(known ? share : 0, -0.25, MOST + 0.25);
        const up = k ? 1 : -1; // a triangle above the line, one below it
        set(marks[k], { d: known ? `M${at} ${2 * up}l9 ${18 * up}h-18Z` : "" });
      });
      set(svg, { "data-over": pull > overshoot });
    };
  }

  function build(figure, data, nmpc) {
    const begin = { state: data.start, theta: data.theta, noise: [0, 0], alpha: data.alpha };
    const { read, move } = shared.state(begin, show);
    let found = {};
    shared.heading(figure, words);
    const parts = [sliders(figure, read, move), steps(figure), gauge(figure, data)];
    add(figure, "p", { class: "legend" }, words.legend);
    const tell = shared.results(figure);
    const last = add(figure, "div", { class: "last buttons" });
    shared.button(last, words.draw, () => move({ noise: normal() }));
    shared.button(last, words.next, () => {
      if (found.again) move({ state: found.next, theta: found.moved });
    });
    shared.button(last, words.reset, () => move(begin));

    function show(given) {
      found = update(nmpc, data, given);
      tell(words.results(found, data));
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found };
    }
    show(begin);
  }

  shared.begin("update", build);
})();
