// Every word that a reader of a live figure sees or hears: `parts` are those of several, the rest one figure's.
(() => {
  "use strict";

  // A number with so many digits, with a minus sign that is one; none before a zero.
  const fixed = (number, digits) => number.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "\u2212");

  const parts = {
    fixed,
    none: "This browser does not run WebAssembly, so the figure stays as it is printed above.",
    robot: "Robot, start",
    heading: "Robot, heading",
    obstacle: (number) => `Obstacle ${number}`,
    tick: (metres, last) => fixed(metres, 0) + (last ? " m" : ""),
    place: (x, y) => `x ${fixed(x, 2)} m, y ${fixed(y, 2)} m`,
    angle: (radians) => `${fixed((radians * 180) / Math.PI, 0)} degrees`,
    symbols: { // letter, its subscript, and the subscript's own
      x: ["θ", "x"], y: ["θ", "y"], heading: ["θ", "φ"], v: ["θ", "v"], nu: ["θ", "ν"],
      x_f: ["θ", "x", "f"], y_f: ["θ", "y", "f"], heading_f: ["θ", "φ", "f"], c: ["θ", "c"], horizon: ["N"],
    },
    sliders: {
      x: "theta x, weight of the distance in x at each planned step",
      y: "theta y, weight of the distance in y at each planned step",
      heading: "theta phi, weight of the heading at each planned step",
      v: "theta v, weight of the speed",
      nu: "theta nu, weight of the turn rate",
      x_f: "theta x f, weight of the distance in x at the end of the plan",
      y_f: "theta y f, weight of the distance in y at the end of the plan",
      heading_f: "theta phi f, weight of the heading at the end of the plan",
      c: "theta c, tightens the obstacle constraint",
    },
  };

  const controller = {
    map: "Map of the robot, its plan, its closed loop and the obstacles, which can be moved",
    handles: "What can be moved on the map",
    title: "Try it: the controller of this chapter, solved in your browser.",
    hint: "Drag the robot, the tip of its arrow or an obstacle; or click one and then its new place; "
      + "or reach it with Tab and press the arrow keys, with Shift for larger steps.",
    legend: (steps) => `Thin line: closed loop of ${steps} steps, without noise. `
      + "Thick line: first plan, a dot for each step. Dotted line: closed loop before any change.",
    // A name of `symbols` stands for its symbol.
    questions: [
      "What does", "c", "do to the distance from the obstacles? What does the robot miss with a smaller",
      "horizon", "?",
    ],
    reset: "Reset",
    target: "target",
    horizon: "N, steps planned",
    groups: {
      "On the way": ["x", "y", "heading"],
      Inputs: ["v", "nu"],
      "At the end": ["x_f", "y_f", "heading_f"],
      "Constraint, horizon": ["c", "horizon"],
    },
    // Lines of words and numbers in turn.
    results: ({ plan, parts, cost }) => [
      [
        "Value V of the plan:", fixed(plan.value, 1), "= on the way", fixed(parts.stages, 1),
        "+ inputs", fixed(parts.inputs, 1), "+ at the end", fixed(parts.end, 1),
        "+ slacks", fixed(parts.slacks, 1),
      ],
      [
        "First action:", `${fixed(plan.action[0], 2)} m/s, ${fixed(plan.action[1], 2)} rad/s`,
        "; largest slack:", fixed(plan.slack, 3), "; cost of the closed loop:", fixed(cost, 1),
      ],
    ],
    failed: (step) => `The solver found no plan at step ${step}; the closed loop ends there.`,
  };

  const learners = {
    frozen: "frozen arm", random: "random directions", matched: "matched steps", QL: "Q-learning",
  };

  const named = (learner) => learners[learner] ?? learner;

  const runs = {
    map: "Published runs: their trajectories, costs and parameters, episode by episode",
    title: "Try it: follow published runs from the first episode to the last.",
    hint: "Choose one or two runs. Then press Play, or move the slider with the mouse or the arrow keys. The robot "
      + "follows the controller of that episode, solved in your browser.",
    target: "target",
    choices: { first: "Learner", second: "Beside it", layout: "Layout", decay: "Noise decays", seed: "Seed" },
    option: (name, value) => {
      if (name === "decay") return `per ${value}`;
      return value === "" ? "none" : named(value);
    },
    slider: "Episode, a step of ten",
    play: "Play",
    pause: "Pause",
    after: (episode) => `episode ${episode}`,
    charts: { training: "Cost of a training episode, with noise", costs: "Cost without noise" },
    theta: (name) => `${parts.sliders[name]}, over the episodes`,
    cost: (number) => fixed(number, 0),
    weight: (number) => (Math.abs(number) < 1000 ? fixed(number, Math.abs(number) < 1 ? 3 : 2) : number.toExponential(1)),
    missing: (learner, { layout, decay, seed }) => (
      `There is no run of ${named(learner)} in layout ${layout} with noise that decays per ${decay} and seed ${seed}.`
    ),
    absent: "The runs of this layout could not be loaded.",
    results: (found, episode) => found.map(({ learner, training, judged, failed, states }) => {
      const name = `${named(learner)}:`, after = ["; without noise", fixed(judged, 1)];
      if (!Number.isFinite(judged)) return [`${name} this run was stopped before episode ${episode}.`];
      if (failed) after.push(`; the solver found no plan at step ${states.length}`);
      if (!episode) return [`${name} before training`, "", ...after];
      return [`${name} cost of episode ${episode}`, Number.isFinite(training) ? fixed(training, 1) : "cut short", ...after];
    }),
    legend: (steps) => `Map: ${steps} steps without noise; dashed circles are the obstacles' safety distance. `
      + "Lines run over the episodes, and end where a run was stopped. The axis of the training cost ends at the "
      + "highest of the frozen arm, that of the cost without noise at 1.3 times the cost at the start; a line that "
      + "leaves its axis goes on beyond it.",
  };

  window.nmpcrl = { ...window.nmpcrl, words: { parts, controller, runs } };
})();
