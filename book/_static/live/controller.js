// The live figure of the controller: move the robot, the obstacles, theta and N, and see what it then does.
(() => {
  "use strict";

  const { add, set, plane, mapParts, slider, weight, parts: shared, words: { controller: words } } = window.nmpcrl;
  const { points } = shared;

  // The parts of V. It is quadratic in each weight, so a weight's part is half its product with its feature.
  function shares({ theta }, { value, features }) {
    const half = theta.map((weight, k) => (weight * features[k]) / 2);
    const sum = (from, to) => half.slice(from, to).reduce((a, b) => a + b);
    const parts = { stages: sum(0, 3), inputs: sum(3, 5), end: sum(5, 8) };
    return { ...parts, slacks: value - parts.stages - parts.inputs - parts.end };
  }

  function closedLoop(map, before) {
    add(map.ground, "polyline", { class: "before", points: points(before.states) });
    const line = add(map.ground, "polyline", { class: "loop" });
    return (_, { states }) => set(line, { points: points(states) });
  }

  function horizon(group, { ranges: { horizon: range } }, move) {
    const kind = { name: "horizon", label: words.horizon, range, text: String };
    return slider(group, kind, {
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
        name === "horizon" ? horizon(group, data, move) : weight(group, name, data, read, move)
      ));
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  function questions(parent, reset) {
    const last = add(parent, "div", { class: "last" });
    shared.write(add(last, "p"), words.questions);
    shared.button(last, words.reset, reset);
  }

  function build(figure, data, { rollout }) {
    const begin = { start: data.start, theta: data.theta, horizon: data.horizon, discs: data.problem.discs };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const map = plane(figure, data.view, words.handles);
    mapParts.background(map, data);
    const parts = [
      ...mapParts.handles(map, data, read, move),
      closedLoop(map, rollout(begin, data.steps)),
      mapParts.planned(map, data),
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
