// The live figure of the controller: move the robot, the obstacles, theta and N, and see what it then does.
(() => {
  "use strict";

  const { add, set, plane, mapParts, slider, weight, button, numbers: { points, fixed }, parts: shared } = window.nmpcrl;
  const GROUPS = {
    "On the way": ["x", "y", "heading"],
    Inputs: ["v", "nu"],
    "At the end": ["x_f", "y_f", "heading_f"],
    "Constraint, horizon": ["c", "horizon"],
  };

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
    const kind = { name: "horizon", label: "N, steps planned", range, text: String };
    return slider(group, kind, {
      read: (given) => given.horizon,
      write: (number) => move({ horizon: number }),
    });
  }

  function sliders(parent, data, read, move) {
    const row = add(parent, "div", { class: "groups" });
    const all = Object.entries(GROUPS).flatMap(([legend, names]) => {
      const group = add(row, "fieldset");
      add(group, "legend", {}, legend);
      return names.map((name) => (
        name === "horizon" ? horizon(group, data, move) : weight(group, name, data, read, move)
      ));
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  // Lines of texts and numbers in turn.
  const results = ({ plan, parts, cost }) => [
    [
      "Value V of the plan:", fixed(plan.value, 1), "= on the way", fixed(parts.stages, 1),
      "+ inputs", fixed(parts.inputs, 1), "+ at the end", fixed(parts.end, 1), "+ slacks", fixed(parts.slacks, 1),
    ],
    [
      "First action:", `${fixed(plan.action[0], 2)} m/s, ${fixed(plan.action[1], 2)} rad/s`,
      "; largest slack:", fixed(plan.slack, 3), "; cost of the closed loop:", fixed(cost, 1),
    ],
  ];

  function build(figure, data, { rollout }) {
    const begin = { start: data.start, theta: data.theta, horizon: data.horizon, discs: data.problem.discs };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, {
      label: "Map of the robot, its plan, its closed loop and the obstacles, which can be moved",
      title: "Try it: the controller of this chapter, solved in your browser.",
      hint: "Drag the robot, the tip of its arrow or an obstacle; or click one and then its new place; "
        + "or reach it with Tab and press the arrow keys, with Shift for larger steps.",
    });
    const map = plane(figure, data.view, "What can be moved on the map");
    mapParts.background(map, data);
    const parts = [
      ...mapParts.handles(map, data, read, move),
      closedLoop(map, rollout(begin, data.steps)),
      mapParts.planned(map, data),
    ];
    add(figure, "p", { class: "legend" }, `Thin line: closed loop of ${data.steps} steps, without noise. `
      + "Thick line: first plan, a dot for each step. Dotted line: closed loop before any change.");
    const tell = shared.results(figure);
    parts.push(sliders(figure, data, read, move));
    const last = add(figure, "div", { class: "last" });
    shared.write(add(last, "p"), "What does {c} do to the distance from the obstacles? What does the robot miss with a smaller {horizon}?");
    button(last, "Reset all", () => move(begin));

    function show(given) {
      const found = rollout(given, data.steps);
      if (found.plan) found.parts = shares(given, found.plan);
      tell(found.failed ? [[`The solver found no plan at step ${found.states.length}; the closed loop ends there.`]] : results(found));
      for (const draw of parts) draw(given, found);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("controller", build);
})();
