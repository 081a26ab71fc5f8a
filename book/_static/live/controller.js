// The live figure of the controller: move the robot, the obstacles, theta and N, and see what it then does.
(() => {
  "use strict";

  const { add, set, plane, parts: shared, words: { controller: words, parts: { symbols } } } = window.nmpcrl;
  const { points, symbol } = shared;

  // The parts of V. It is quadratic in each weight, so a weight's part is half its product with its feature.
  function shares({ theta }, { value, features }) {
    const half = theta.map((weight, k) => (weight * features[k]) / 2);
    const sum = (from, to) => half.slice(from, to).reduce((a, b) => a + b);
    const parts = { stages: sum(0, 3), inputs: sum(3, 5), end: sum(5, 8) };
    return { ...parts, slacks: value - parts.stages - parts.inputs - parts.end };
  }

  function trajectories(map, { problem: { target: [x, y] } }, before) {
    add(map.ground, "polyline", { class: "before", points: points(before.states) });
    const loop = add(map.ground, "polyline", { class: "loop" });
    const plan = add(map.ground, "polyline", { class: "plan" });
    const dots = add(map.ground, "g", { class: "dots" });
    add(map.ground, "circle", { class: "target", cx: x, cy: y });
    map.write(words.target, x, y, { class: "name" });
    return (_, found) => {
      const planned = found.plan?.states ?? [];
      set(loop, { points: points(found.states) });
      set(plan, { points: points(planned) });
      dots.replaceChildren();
      for (const [cx, cy] of planned) add(dots, "circle", { cx, cy });
    };
  }

  function horizon(group, { ranges: { horizon: range } }, move) {
    const kind = { name: "horizon", label: words.horizon, range, text: String };
    return shared.slider(group, kind, {
      read: (given) => given.horizon,
      write: (number) => move({ horizon: number }),
    });
  }

  function sliders(parent, data, read, move) {
    const row = add(parent, "div", { class: "groups" });
    const all = Object.entries(words.groups).flatMap(([legend, names]) => {
      const group = add(row, "fieldset");
      add(group, "legend", {}, legend);
      return names.map((name) => (
        name === "horizon" ? horizon(group, data, move) : shared.weight(group, name, data, read, move)
      ));
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  function questions(parent, reset) {
    const last = add(parent, "div", { class: "last" });
    const line = add(last, "p");
    for (const text of words.questions) {
      if (text in symbols) symbol(line, text);
      else line.append(text === "?" ? text : ` ${text} `);
    }
    shared.button(last, words.reset, reset);
  }

  function build(figure, data, { rollout }) {
    const begin = { start: data.start, theta: data.theta, horizon: data.horizon, discs: data.problem.discs };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const map = plane(figure, data.view, words.handles);
    shared.background(map, data);
    const parts = [
      shared.obstacles(map, data, read, move),
      shared.robot(map, data, read, move),
      shared.arrow(map, read, move),
      trajectories(map, data, rollout(begin, data.steps)),
    ];
    add(figure, "p", { class: "legend" }, words.legend(data.steps));
    const tell = shared.results(figure);
    parts.push(sliders(figure, data, read, move));
    questions(figure, () => move(begin));

    function show(given) {
      const found = rollout(given, data.steps);
      if (found.plan) found.parts = shares(given, found.plan);
      tell(found.failed ? [[words.failed(found.states.length)]] : words.results(found));
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("controller", build);
})();
