// Every word that a reader of the figure of moving obstacles sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed } = words.parts;

  words.moving = {
    map: "Map of two robots among obstacles that move; obstacles and their velocities can be moved",
    handles: "What can be moved on the map",
    title: "Try it: two robots among obstacles that move, solved in your browser.",
    hint: "Press Play. Drag an obstacle to where it is at the time shown, and the tip of its arrow, which is as long as "
      + "its motion in 4 s; with the tip on the disc, it stands. Or reach both with Tab and press the arrow keys, with "
      + "Shift for larger steps.",
    robots: { extrapolated: "Extrapolates each velocity", frozen: "Plans as if they stood" },
    velocity: (number) => `Obstacle ${number}, velocity`,
    speed: (vx, vy) => (vx || vy ? `${fixed(vx, 2)} m/s in x, ${fixed(vy, 2)} m/s in y` : "stands"),
    time: "Time",
    seconds: (seconds) => `${fixed(seconds, 1)} s`,
    // With symbols.
    questions: "Which {c} keeps the second robot out of every obstacle, and what does it then cost? Shorten the arrow on "
      + "the left a little: which robot costs less now?",
    reset: "Reset all",
    legend: "Thin lines: each robot's whole way. Thick lines: the part that is driven. Dots: its plan at the time shown. A "
      + "robot that is inside an obstacle's dashed circle has a red ring.",
    // A line of words and numbers in turn.
    results: (name, { states, costs, inside, failed }, step) => {
      const now = Math.min(step, states.length - 1);
      if (failed) return [`${name}: the solver found no plan at step ${states.length}, and the episode ends there.`];
      return [
        `${name}: cost`, fixed(costs[now], 0), "so far,", fixed(costs.at(-1), 0), "in all; states inside an obstacle:",
        `${inside[now]}`, "so far,", `${inside.at(-1)}`, "in all",
      ];
    },
  };
})();
