// Every word that a reader of the controller's figure sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed } = words.parts;

  words.controller = {
    map: "Map of the robot, its plan, its closed loop and the obstacles, which can be moved",
    handles: "What can be moved on the map",
    title: "Try it: the controller of this chapter, solved in your browser.",
    hint: "Drag the robot, the tip of its arrow or an obstacle; or click one and then its new place; "
      + "or reach it with Tab and press the arrow keys, with Shift for larger steps.",
    legend: (steps) => `Thin line: closed loop of ${steps} steps, without noise. `
      + "Thick line: first plan, a dot for each step. Dotted line: closed loop before any change.",
    // With symbols.
    questions: "What does {c} do to the distance from the obstacles? What does the robot miss with a smaller {horizon}?",
    reset: "Reset all",
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
})();
