// Every word that a reader of the gradient's figure sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed, scientific } = words.parts;

  words.gradient = {
    map: "Map of the robot, its plan and the obstacles, the gradient of the value, and finite differences",
    handles: "What can be moved on the map",
    title: "Try it: the envelope gradient and finite differences, computed in your browser.",
    hint: "Drag the robot, the tip of its arrow or an obstacle, or reach it with Tab and press the arrow keys; "
      + "move a component of θ, or the step h of the differences.",
    legend: "Filled bar: envelope gradient. Striped bar: central differences with step h. "
      + "The bars are logarithmic, from 0.01 to 10 000; the numbers are in this order.",
    lines: "Solid line: central differences. Dashed line: forward differences. Dots: the step h.",
    curves: "Distance of finite differences to the envelope gradient, relative, against their step",
    across: "step h (no unit)",
    step: "h, step of the finite differences",
    reset: "Reset all",
    pair: ({ envelope, difference }) => `${fixed(envelope, 3)} | ${fixed(difference, 3)}`,
    results: ({ chosen: { step, errors } }) => [
      [
        `Relative distance to the envelope gradient with h = ${scientific(step)}: central differences, 18 more solves,`,
        scientific(errors.central), "; forward differences, 9 more solves,", scientific(errors.forward),
      ],
    ],
    failed: "The solver found no plan here, or none beside it.",
  };
})();
