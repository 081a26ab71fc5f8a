// What is shown of two learners: their policies on the map, theta, and numbers over the episodes.
//
// A part is made with `data`, what the page is given, and returns what draws it: (found) => {}, of side_by_side.js.
(() => {
  "use strict";

  const {
    add, set, plane, mapParts, chart, key, trace, parts: shared,
    words: { learners: words, parts: { sliders: meanings } },
  } = window.nmpcrl;
  const GAUGE = 4; // its end
  const LOWEST = 0.97; // of the axis of costs, times the least of all
  const HIGHER = 1.02, HIGHEST = 1.3; // the range of its end, times the cost of theta_init
  const FARTHEST = 5; // what a bar of theta shows at most, times its first value
  const NO_ERROR = 1; // the power of ten that stands on the axis before there is an error
  const LEVEL = { color: "var(--quiet)", dashes: "2 2" };

  function map(parent, data, label) {
    const ground = plane(parent, data.view, label);
    mapParts.background(ground, data);
    data.problem.discs.forEach((disc, k) => mapParts.circles(ground.ground, disc, data.radii[k]));
    mapParts.target(ground, data);
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
      const least = Math.max(Math.min(0, ...numbers), -FARTHEST * first);
      const most = Math.min(Math.max(2 * first, ...numbers), FARTHEST * first);
      const share = (number) => shared.clamp((100 * (number - least)) / (most - least), 0, 100);
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

  const across = (y, episodes) => [[0, y], [episodes, y]];
  const over = (found, looks, points) => found.map((now) => ({ look: looks[now.learner], points: points(now) }));
  const numbered = (numbers) => numbers.map((number, k) => [k + 1, number]); // of episodes

  // Every chart: (found) => { lines, range, text }.
  const drawings = {
    costs: ({ looks }, episodes) => (found) => {
      const all = found.flatMap((now) => now.costs.map(({ cost }) => cost)), first = all[0];
      const highest = Math.max(HIGHER * first, ...all.filter(Number.isFinite));
      const learned = over(found, looks, ({ costs }) => costs.map(({ episode, cost }) => [episode, cost]));
      return {
        lines: [{ points: across(first, episodes), look: looks.frozen }, ...learned],
        range: [LOWEST * Math.min(...all), Math.min(HIGHEST * first, highest)],
        text: words.cost,
      };
    },
    gauges: ({ looks, overshoot }, episodes) => (found) => ({
      lines: [
        { points: across(overshoot, episodes), look: LEVEL }, ...over(found, looks, (now) => numbered(now.gauges)),
      ],
      range: [0, GAUGE],
      text: words.cost,
    }),
    errors: ({ looks }) => (found) => { // logarithmic, from one power of ten to another
      const powers = over(found, looks, (now) => numbered(now.errors.map(Math.log10)));
      const all = powers.flatMap(({ points }) => points.map(([, power]) => power)).filter(Number.isFinite);
      const least = Math.floor(Math.min(...all, NO_ERROR)), most = Math.ceil(Math.max(...all, NO_ERROR));
      return { lines: powers, range: [least, Math.max(most, least + 1)], text: words.power };
    },
  };

  function charts(parent, data) {
    const [{ episodes, evaluateEvery: every }] = Object.values(data.settings), { overshoot } = data;
    const row = add(parent, "div", { class: "costs" });
    const all = data.charts.map((name) => {
      const label = words.charts[name]({ every, overshoot }), find = drawings[name](data, episodes);
      const one = chart(row, { label, last: episodes });
      one.title.textContent = label;
      return { one, find };
    });
    return (found) => {
      for (const { one, find } of all) {
        const { lines, range, text } = find(found);
        one.draw(lines, range, text);
      }
    };
  }

  function keys(parent, { looks }) {
    const line = add(parent, "p", { class: "key" });
    for (const [name, look] of Object.entries(looks)) key(line, words.names[name], look);
  }

  window.nmpcrl = { ...window.nmpcrl, learnersShown: { map, gauges, weights, charts, keys } };
})();
