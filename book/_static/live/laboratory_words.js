// Every word that a reader of the laboratory sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed } = words.parts;
  const percent = (share) => `${fixed(100 * Math.abs(share), 1)} %`;
  const LONG = 60; // letters of a link that are repeated
  const short = (text) => (text.length > LONG ? `${text.slice(0, LONG)}…` : text);
  const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

  words.laboratory = {
    map: "Laboratory: a map of obstacles, start and target, the settings of a run, and its training",
    handles: "What can be moved on the map",
    title: "Place the obstacles, and train.",
    hint: "Drag an obstacle, the robot, the target or the tip of an arrow; or click one and then its new place; "
      + "or reach it with Tab and press the arrow keys, with Shift for larger steps. Delete removes an obstacle.",
    legend: "Thin line: closed loop without noise, with θ at the start, or with the last θ of the chosen run; then "
      + "the dotted line is that with θ at the start. Thick line: first plan.",
    target: "Target",
    targetHeading: "Target, heading",
    add: "Add an obstacle",
    remove: "Remove the last one",
    reset: "Reset all",
    gallery: "Six examples, to open with a click:",
    names: {
      learner: "Learner", alpha: "Step size α", beta: "Step size β", beta_tdc: "Step size β", zeta: "Learning rate ζ",
      decay: "Decay per", decay_rate: "Decay factor c", horizon: "Horizon N", seed: "Seed", episodes: "Episodes",
    },
    learners: {
      ES: "ES: Expected Sarsa", DES: "DES: network of (s, a)", RDES: "RDES: network of (s, a, θ)",
      GES: "GES: gradient Expected Sarsa", TDC: "TDC: exact gradient TD", QL: "QL: Q-learning", frozen: "frozen: θ never moves",
    },
    refused: (name, { least, most, whole }) => (
      `${words.laboratory.names[name]}: a ${whole ? "whole " : ""}number `
      + `${least > 0 && least < 1e-300 ? "above 0 and at most" : `from ${least} to`} ${most}, please.`
    ),
    train: "Train",
    stop: "Stop",
    seeds: (count) => `Other seeds: ${count} more runs`,
    progress: "Episodes trained",
    training: (name, done, all) => `${name}: episode ${done} of ${all}`,
    arm: (name) => `frozen arm of ${name}`,
    waiting: (count) => (count ? `; ${plural(count, "run")} waiting` : ""),
    run: (number, { learner, seed }, others) => [`${number}: ${learner}, seed ${seed}`, ...others].join(", "),
    other: {
      alpha: "α", beta: "β", beta_tdc: "β", zeta: "ζ", decay: "decay per", decay_rate: "c", horizon: "N",
      episodes: "episodes",
    },
    layout: (letter) => `layout ${letter}`,
    elsewhere: "own places",
    runs: "Runs",
    none: "No run yet. A run of 300 episodes takes a few seconds, one that fits a network half a minute or more.",
    removeRun: (name) => `Remove ${name}`,
    removeShort: "Remove",
    ends: {
      running: "training", waiting: "waiting", finished: "", stopped: "stopped",
      diverged: "diverged: θ left the numbers that a solver is given, or ten episodes in a row ended in a failed solve",
    },
    cost: (before, after) => {
      if (after === null) return `noise-free cost ${fixed(before, 1)} at the start`;
      if (!Number.isFinite(after)) return `no noise-free cost at the end; ${fixed(before, 1)} at the start`;
      const change = 1 - after / before;
      const than = Math.abs(change) < 5e-4 ? "as much as" : `${percent(change)} ${change > 0 ? "less" : "more"} than`;
      return `noise-free cost ${fixed(after, 1)} (mean of the last rollouts), ${than} the frozen arm's ${fixed(before, 1)}`;
    },
    frozen: "frozen",
    plots: {
      judged: {
        title: "Cost without noise, and the frozen arm's (grey)",
        label: "Cost of rollouts without noise over episodes, for each run and for the frozen arm",
      },
      cost: {
        title: "Cost of training, and the frozen arm's under the same noise (grey)",
        label: "Cost of each training episode, for each run and for the frozen arm",
      },
      theta: {
        title: "Components of θ in the chosen run; the four that move most have names",
        label: "Components of theta after each episode of the chosen run",
      },
      step: {
        title: "Largest α‖φ‖² of each episode: a step overshoots above 2",
        label: "Largest alpha times the squared norm of phi of each episode, for each run, and the line at 2",
      },
    },
    now: ({ cost, failed, states }, who) => [
      failed
        ? [`The solver found no plan at step ${states.length}; the closed loop ends there.`]
        : [`Closed loop ${who}: cost`, fixed(cost, 1)],
    ],
    atStart: "with θ at the start",
    ofRun: (number) => `with the last θ of run ${number}`,
    // What a link may say of a setting.
    allowed: (name, { fields, most, theta, limits }) => {
      const field = fields.find((each) => each.name === name);
      if (field?.choices) return `${words.laboratory.names[name]}: one of ${field.choices.join(", ")}, please.`;
      if (field) return words.laboratory.refused(name, field);
      const places = {
        layout: `Obstacles: 1 to ${most} pairs x,y on the map with ; between them, please.`,
        start: "Start: x,y,heading within the walls and one turn, please.",
        target: "Target: x,y,heading within the walls and one turn, please.",
        theta: `θ: ${theta.length} numbers from ${-limits.absurd} to ${limits.absurd}, please.`,
      };
      return Object.hasOwn(places, name) ? places[name] : "No setting has this name.";
    },
    damaged: (name, text, data) => (
      `This link is not read, and what is set stays: it says “${short(`${name}=${text}`)}”. `
      + words.laboratory.allowed(name, data)
    ),
    failed: (why) => `this browser could not train: ${why}`,
    armFailed: (why) => `this browser could not train its frozen arm: ${why}`,
    noWorker: "it did not start a worker",
    link: "A link to these settings",
    copyLink: "Copy link",
    copied: "Copied.",
    notCopied: "This browser does not copy; the text is selected.",
    python: "Continue in Python",
    pythonHint: ({ learner }) => {
      const same = "The command and the code train the same run";
      if (learner !== "DES" && learner !== "RDES") {
        return `${same}, with the same numbers but for rounding, which grows where learning is chaotic.`;
      }
      return `${same}, with the same numbers but for rounding up to the network’s first fit. A fit is in single precision, and Python adds its numbers in `
        + "another order: after it the runs part, as on two computers.";
    },
    commandLabel: "Command of the same run",
    codeLabel: "Library code of the same run",
    copyCommand: "Copy command",
    copyCode: "Copy code",
  };
})();
