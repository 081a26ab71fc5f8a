// Every word that a reader of a live figure sees or hears: `parts` are those of several, the rest one figure's.
// In results, and where it says so, {c} stands for the symbol of c.
(() => {
  "use strict";

  const POWERS = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"; // digits as exponents

  // A number with so many digits, with a minus sign that is one; none before a zero.
  const fixed = (number, digits) => number.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "\u2212");

  const power = (exponent) => `10${`${exponent}`.replace("-", "\u207b").replace(/\d/g, (digit) => POWERS[digit])}`;

  // A number of any size, with three digits.
  function sized(number) {
    const size = Math.abs(number);
    if (!Number.isFinite(number)) return "out of range";
    if (size === 0 || (size >= 0.01 && size < 10000)) return fixed(number, size >= 100 ? 1 : 3);
    const [digits, exponent] = number.toExponential(2).split("e");
    return `${digits.replace("-", "\u2212")}\u00a0\u00b7\u00a0${power(Number(exponent))}`;
  }

  // A power of ten, perhaps with a factor in front.
  function scientific(number) {
    const exponent = Math.floor(Math.log10(number) + 1e-9), factor = fixed(number / 10 ** exponent, 1);
    return (factor === "1.0" ? "" : `${factor} · `) + power(exponent);
  }

  const parts = {
    fixed,
    scientific,
    none: "This browser does not run WebAssembly, or cannot unpack it, so the figure stays as it is printed above.",
    target: "target",
    robot: "Robot, start",
    heading: "Robot, heading",
    obstacle: (number) => `Obstacle ${number}`,
    tick: (metres, last) => fixed(metres, 0) + (last ? " m" : ""),
    place: (x, y) => `x ${fixed(x, 2)} m, y ${fixed(y, 2)} m`,
    angle: (radians) => `${fixed((radians * 180) / Math.PI, 0)} degrees`,
    symbols: { // letter, its subscript, and the subscript's own
      x: ["θ", "x"], y: ["θ", "y"], heading: ["θ", "φ"], v: ["θ", "v"], nu: ["θ", "ν"],
      x_f: ["θ", "x", "f"], y_f: ["θ", "y", "f"], heading_f: ["θ", "φ", "f"], c: ["θ", "c"], horizon: ["N"],
      alpha: ["α"], beta: ["β"], gamma: ["γ"], epsilon_v: ["ε", "v"], epsilon_nu: ["ε", "ν"], h: ["h"], walk: ["d"],
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
    // With symbols.
    questions: "What does {c} do to the distance from the obstacles? What does the robot miss with a smaller {horizon}?",
    reset: "Reset",
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

  const names = {
    frozen: "frozen arm", random: "random directions", matched: "matched steps", QL: "Q-learning",
  };

  const named = (learner) => names[learner] ?? learner;

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

  const player = { play: "Play", pause: "Pause", step: "Step" };

  const chain = {
    map: "The chain of two states, whose step sizes and discount can be moved",
    title: "Try it: the chain, updated in your browser by the functions that train the robot.",
    hint: "Move the sliders with the mouse or the arrow keys. Press Step for one update, or Play for all.",
    states: {
      legend: "Updates are made",
      first: "in the first state only (off-policy)",
      both: "in both states in turn (on-policy)",
    },
    sliders: {
      alpha: "alpha, step size of theta",
      beta: "beta, step size of w",
      gamma: "gamma, discount",
    },
    number: (value) => fixed(value, 2),
    slider: "Updates made",
    after: (updates) => `after ${updates} update${updates === 1 ? "" : "s"}`,
    charts: {
      theta: "|θ| over the updates:",
      error: "Gradient TD, in absolute value:",
    },
    power,
    keys: { ES: "semi-gradient", GES: "gradient TD", delta: "TD error δ", predicted: "prediction wφ" },
    legend: "Logarithmic axes: a dip is a change of sign; a line that leaves an axis goes on beyond it. "
      + "Pale: what is still to come.",
    question: "How small may β be before gradient TD diverges, too? And what changes with updates in both states?",
    reset: "Reset",
    results: ({ ES, GES }, { alpha, beta, at }) => [
      [
        "Semi-gradient: θ =", sized(ES[at].theta), "; value of the state that is updated next", sized(ES[at].value),
        "; its target", sized(ES[at].target), "; δ =", sized(ES[at].delta),
      ],
      [
        "Gradient TD: θ =", sized(GES[at].theta), "; w =", sized(GES[at].w), "; value", sized(GES[at].value),
        "; target", sized(GES[at].target), "; δ =", sized(GES[at].delta),
        "; predicted: wφ =", sized(GES[at].predicted),
      ],
      [
        `After ${ES.length - 1} updates, with β / α =`, fixed(beta / alpha, 2), "; θ of the semi-gradient",
        sized(ES.at(-1).theta), "; of gradient TD", sized(GES.at(-1).theta),
      ],
    ],
  };

  const training = "Press Train, and Stop when you like; or go on by one episode or one step of both. "
    + "Whatever you choose anew, training begins again.";

  const learners = {
    of: { // each figure of two learners
      learners: {
        map: "Map with the trajectories of the policies that ES and GES have learned, and the obstacles",
        title: "Try it: ES and GES learn side by side from the same noise, in your browser.",
        hint: training,
      },
      networks: {
        map: "Map with the trajectories of the policies that DES and RDES have learned, and the obstacles",
        title: "Try it: DES and RDES learn side by side from the same noise, in your browser.",
        hint: `Each step solves once and fits a network once. ${training}`,
        question: "Which of the two networks predicts the next value better? And what becomes of its lead with a "
          + "smaller {alpha}, which moves θ less?",
      },
    },
    choices: { decay: "Noise decays", seed: "Seed" },
    option: (value) => (typeof value === "number" ? String(value) : `per ${value}`),
    alpha: "alpha, step size of theta",
    size: sized,
    buttons: { train: "Train", stop: "Stop", wholeEpisode: "One episode", step: "One step", reset: "Reset" },
    progress: "Episodes done",
    done: (episode, all) => `episode ${episode} of ${all}`,
    names: { ES: "ES", GES: "GES", DES: "DES", RDES: "RDES", frozen: "frozen arm" },
    gauge: (name) => `${name}: largest alpha times squared norm of phi of the episode`,
    gauged: (number, overshoot) => {
      if (!Number.isFinite(number)) return "no step yet";
      return number > overshoot ? `${fixed(number, 2)}, overshoots` : fixed(number, 2);
    },
    gauges: (overshoot) => `Largest α‖φ‖² of the episode so far; the mark is at ${overshoot}:`,
    weights: "θ now; the mark is at its first value:",
    weight: (number) => (Math.abs(number) < 100 ? fixed(number, 3) : sized(number)),
    charts: {
      costs: ({ every }) => `Cost without noise, every ${every} episodes`,
      gauges: ({ overshoot }) => `Largest α‖φ‖² of each episode; dotted: ${overshoot}`,
      errors: () => "Error of the predicted next value, each episode",
    },
    cost: (number) => fixed(number, 0),
    power,
    target: "target",
    legend: ({ steps }) => `The map shows ${steps} steps without noise; circles are the robot in training.`,
    axes: {
      costs: "The axis of the cost ends at 1.3 times the cost of the frozen arm or before; a line that leaves an axis goes on.",
      gauges: "",
      errors: "The error is the root mean square over an episode of the prediction minus the solved value; its axis "
        + "is logarithmic.",
    },
    result: ({ learner, episode, step, costs, errors, diverged }, charts) => {
      const { cost, episode: judged } = costs.at(-1), first = costs[0].cost;
      const where = step ? `episode ${step.episode + 1}, step ${step.time + 1}` : "not begun";
      const after = judged ? `after ${judged} episodes` : "before training";
      const change = fixed(100 * (1 - cost / first), 1);
      const texts = [
        `${learner}:`, where, `; cost without noise ${after}`, fixed(cost, 1),
        "; reduction from the frozen arm's", `${change}\u00a0%`,
      ];
      const error = errors.at(-1);
      if (charts.includes("errors") && Number.isFinite(error)) {
        texts.push(`; error of the next value in episode ${errors.length}`, fixed(error, 1));
      }
      return diverged ? [...texts, `; diverged in episode ${episode}`] : texts;
    },
  };

  const gradient = {
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
    reset: "Reset",
    pair: ({ envelope, difference }) => `${fixed(envelope, 3)} | ${fixed(difference, 3)}`,
    results: ({ chosen: { step, errors } }) => [
      [
        `Relative distance to the envelope gradient with h = ${scientific(step)}: central differences, 18 more solves,`,
        scientific(errors.central), "; forward differences, 9 more solves,", scientific(errors.forward),
      ],
    ],
    failed: "The solver found no plan here, or none beside it.",
  };

  function side(offset) {
    const distance = fixed(1000 * Math.abs(offset), 1);
    if (distance === "0.0") return "on";
    return `${distance} mm ${offset < 0 ? "inside" : "outside"}`;
  }

  const kink = {
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

  const update = {
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
    reset: "Reset",
    results: ({ following, pull, closed, again }, { overshoot }) => [
      following ? ["α‖φ‖² =", fixed(pull, 3), "; the update closes", again ? fixed(closed, 3) : "?", "of the TD error."]
        : ["The solver found no plan."],
      ...(following && !again ? [["With the new θ the solver found no plan."]] : []),
      ...(pull > overshoot ? [[`α‖φ‖² is above ${overshoot}: the update overshoots.`]] : []),
    ],
  };

  window.nmpcrl = { ...window.nmpcrl, words: { parts, controller, gradient, kink, update, runs, player, chain, learners } };
})();
