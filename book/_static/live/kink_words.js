// Every word that a reader of the kink's figure sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed } = words.parts;

  function side(offset) {
    const distance = fixed(1000 * Math.abs(offset), 1);
    if (distance === "0.0") return "on";
    return `${distance} mm ${offset < 0 ? "inside" : "outside"}`;
  }

  words.kink = {
    map: "Map of the robot, its plan and the obstacles, and the value along a walk over a boundary",
    handles: "What can be moved on the map",
    title: "Try it: walk the robot over an obstacle’s boundary.",
    hint: "Drag the robot, or reach it with Tab and press the arrow keys; or walk it with the slider, straight from "
      + "inside the nearest boundary to the outside.",
    walk: "d, distance of the robot from the nearest boundary, negative inside",
    across: "d, distance from the boundary [m]",
    value: "V along the walk", // with a symbol, too
    plots: ["The value along the walk", "The slope of the value in theta c along the walk"],
    slope: "dV/d{c} along the walk", // with a symbol
    reset: "Reset",
    millimetres: (number) => `${fixed(number, 0)} mm`,
    results: ({ plan, boundary: { number, offset }, inside, outside, jump }) => [
      [
        "The robot is", side(offset), `the boundary of obstacle ${number}. V =`, fixed(plan.value, 3),
        "; dV/d{c} =", fixed(plan.features[8], 2),
      ],
      [
        "Just inside the boundary dV/d{c} is", fixed(inside[0].slope, 2), "; just outside it is",
        fixed(outside[0].slope, 2), "; the jump is", fixed(jump, 2),
      ],
    ],
    failed: "The solver found no plan here, or none beside the boundary.",
  };
})();
