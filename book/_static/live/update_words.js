// Every word that a reader of the update's figure sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed, scientific } = words.parts;

  words.update = {
    map: "One update of Expected Sarsa, number by number",
    title: "Try it: one update, computed in your browser.",
    hint: "Move the noise ε of the action and the step size α; apply the update, and go on to the next state.",
    noise: ["epsilon v, noise of the speed", "epsilon nu, noise of the turn rate"],
    alpha: "alpha, step size",
    deviations: (number) => fixed(number, 2),
    power: (exponent) => scientific(10 ** exponent),
    // With symbols: texts and numbers in turn.
    steps: ({ alpha }, { plan, action, cost, next, following, delta, moved, pull, again, closed }) => [
      plan && ["Solve in s: V(s) = ", fixed(plan.value, 3)],
      plan && ["Act: a = ", `${fixed(action[0], 3)} m/s, ${fixed(action[1], 3)} rad/s`],
      plan && [
        "Pay the cost ", fixed(cost, 3),
        " and arrive in s⁺ = ", `(${fixed(next[0], 3)} m, ${fixed(next[1], 3)} m, ${fixed(next[2], 3)} rad)`,
      ],
      following && ["Solve in s⁺: V(s⁺) = ", fixed(following.value, 3)],
      following && ["TD error: δ = ", fixed(delta, 3)],
      following && [
        `Move θ by α δ φ, with α = ${scientific(alpha)}: {x} becomes `, fixed(moved[0], 5), ", {c} ", fixed(moved[8], 5),
      ],
      again && ["Solve in s again, with the new θ: V(s) = ", fixed(again.value, 3)],
    ].filter(Boolean),
    gauge: "From the value V(s), at 0, to its target, at 1, and as far beyond, at 2: where the update leads",
    places: ["V(s)", "target", "as far beyond", ""],
    legend: "Triangle above the line: α‖φ‖², what the update closes to first order. Triangle below: what it does close. "
      + "In the shaded part it ends farther from the target than it began.",
    draw: "Draw noise",
    next: "Apply, go on to s⁺",
    reset: "Reset all",
    results: ({ following, pull, closed, again }, { overshoot }) => [
      following ? ["α‖φ‖² =", fixed(pull, 3), "; the update closes", again ? fixed(closed, 3) : "?", "of the TD error."]
        : ["The solver found no plan."],
      ...(following && !again ? [["With the new θ the solver found no plan."]] : []),
      ...(pull > overshoot ? [[`α‖φ‖² is above ${overshoot}: the update overshoots.`]] : []),
    ],
  };
})();
