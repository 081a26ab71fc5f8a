// The live figure of the gradient: what the envelope theorem gives, and what finite differences do.
(() => {
  "use strict";

  const {
    add, plane, mapParts, slider, weight, graph, parts: shared, words: { gradient: words, parts: { scientific } },
  } = window.nmpcrl;
  const LEAST = -2, DECADES = 6; // of a bar, which is logarithmic
  const IDLE = 120; // after the last change, before the curves are computed [ms]
  const norm = (vector) => Math.hypot(...vector);

  // V with one component of theta moved, all nine in turn; null if one cannot be solved.
  function moved(nmpc, given, h) {
    const plans = given.theta.map((each, k) => (
      nmpc.solve({ ...given, theta: given.theta.with(k, each + h) })
    ));
    return plans.every(Boolean) ? plans.map(({ value }) => value) : null;
  }

  function differences(nmpc, given, { value, features }, h) {
    const above = moved(nmpc, given, h), below = moved(nmpc, given, -h);
    if (!above || !below) return null;
    const central = above.map((each, k) => (each - below[k]) / (2 * h));
    const forward = above.map((each) => (each - value) / h);
    const error = (gradient) => norm(gradient.map((each, k) => each - features[k])) / norm(features);
    return { step: h, central, forward, errors: { central: error(central), forward: error(forward) } };
  }

  function bars(parent, data, read, move) {
    const rows = data.names.map((name) => {
      const row = add(parent, "div", { class: "component" });
      const slide = weight(row, name, data, read, move);
      const pair = add(row, "div", { class: "pair", "aria-hidden": true });
      const both = { envelope: add(pair, "i", { class: "envelope" }), difference: add(pair, "i", { class: "difference" }) };
      return { slide, both, number: add(row, "span", { class: "numbers" }) };
    });
    const share = (number) => shared.clamp((Math.log10(Math.max(number, 1e-300)) - LEAST) / DECADES, 0, 1);
    return (given, { plan, chosen }) => rows.forEach(({ slide, both, number }, k) => {
      slide(given);
      const numbers = { envelope: plan?.features[k] ?? 0, difference: chosen?.central[k] ?? 0 };
      for (const [kind, bar] of Object.entries(both)) bar.style.width = `${100 * share(numbers[kind])}%`;
      number.textContent = words.pair(numbers);
    });
  }

  function stepSlider(parent, steps, move) {
    const kind = { name: "h", label: words.step, range: [0, steps.length - 1, 1], text: (k) => scientific(steps[k]) };
    return slider(add(parent, "div", { class: "wide" }), kind, {
      read: ({ step }) => step,
      write: (step) => move({ step }),
    });
  }

  const evens = (least, most) => (
    Array.from({ length: Math.max(0, most - least + 1) }, (_, k) => least + k).filter((each) => each % 2 === 0)
  );

  // Both errors against the step, on logarithmic axes.
  function curves(parent, steps) {
    const { draw } = graph(parent, words.curves);
    const tick = (exponent) => [exponent, scientific(10 ** exponent)];
    const log = (found, kind) => [Math.log10(found.step), Math.log10(Math.max(found.errors[kind], 1e-14))];
    const [first, last] = [steps.at(0), steps.at(-1)].map(Math.log10);
    const across = evens(Math.ceil(first) + 1, Math.floor(last)).map(tick);
    return (_, { chosen, all }) => {
      const known = (all ?? [chosen]).filter(Boolean);
      const [forward, central] = ["forward", "central"].map((kind) => known.map((found) => log(found, kind)));
      const lowest = Math.floor(Math.min(-10, ...central.map(([, y]) => y)));
      const highest = Math.ceil(Math.max(0, ...forward.map(([, y]) => y)));
      draw({
        x: { name: words.across, from: first, to: last, ticks: across },
        y: { from: lowest, to: highest, ticks: evens(lowest, highest).map(tick) },
        lines: [{ look: "forward", points: forward }, { look: "central", points: central }],
        dots: chosen ? [log(chosen, "forward"), log(chosen, "central")] : [],
      });
    };
  }

  function build(figure, data, nmpc) {
    const begin = { start: data.start, theta: data.theta, discs: data.problem.discs, step: data.step };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const top = add(figure, "div", { class: "columns map" }), left = add(top, "div"), right = add(top, "div");
    const map = plane(left, data.view, words.handles);
    mapParts.background(map, data);
    const parts = [...mapParts.handles(map, data, read, move), mapParts.planned(map, data)];
    const tell = shared.results(figure);
    parts.push(stepSlider(figure, data.steps, move));
    parts.push(curves(right, data.steps));
    add(right, "p", { class: "legend" }, words.lines);
    parts.push(bars(add(figure, "div", { class: "rows" }), data, read, move));
    add(figure, "p", { class: "legend" }, words.legend);
    shared.button(add(figure, "div", { class: "last" }), words.reset, () => move(begin));

    let known = {}, idle = 0; // the curves, which only another step leaves as they are
    function curvesOf({ start, theta, discs }, at) {
      if (known.start !== start || known.theta !== theta || known.discs !== discs) {
        known = { start, theta, discs, all: null };
        clearTimeout(idle);
        idle = setTimeout(() => {
          known.all = data.steps.map(at);
          move({});
        }, IDLE);
      }
      return known.all;
    }

    function show(given) {
      const asked = { state: given.start, theta: given.theta, discs: given.discs, horizon: data.horizon };
      const plan = nmpc.solve(asked);
      const at = (h) => plan && differences(nmpc, asked, plan, h);
      const found = { plan, chosen: at(data.steps[given.step]), all: curvesOf(given, at) };
      tell(found.chosen ? words.results(found) : [[words.failed]]);
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found };
    }
    show(begin);
  }

  shared.begin("gradient", build);
})();
