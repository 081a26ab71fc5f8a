// Every word that a reader of the laboratory sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed, sized } = words.parts;
  const percent = (share) => `${fixed(100 * Math.abs(share), 1)} %`;
  const LONG = 60; // letters of a link that are repeated
  const short = (text) => (text.length > LONG ? `${text.slice(0, LONG)}…` : text);
  const stands = ({ arrives }) => (arrives ? "arrives" : "does not arrive");
  const halted = ({ given, stopped }) => (
    `${given.learner} was stopped in episode ${stopped.episode}, with {${stopped.name}} = ${sized(stopped.value)}. `
  );
  // What a run came to, and what one that is laid over it did. In braces stands the symbol of a component of theta.
  const ended = ({ given, first, last, stopped }) => (
    `${stopped ? halted({ given, stopped }) : ""}${given.learner === "frozen" ? "Without learning" : `After ${last.episode} episodes of ${given.learner}`}, with {c} = ${fixed(last.thetaC, 3)}, the robot `
    + `${stands(last)}, at a cost of ${fixed(last.cost, 0)}${given.learner === "frozen" ? "" : `; at the start it was ${fixed(first.cost, 0)}`}.`
  );
  const apart = ({ error }) => `${fixed(100 * error, 0)} %`;
  const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

  words.laboratory = {
    map: "Laboratory: a map of obstacles, start and target, the settings of a run, and its training",
    handles: "What can be moved on the map",
    title: "Place the obstacles, and train; or see what others found.",
    legend: "Line: closed loop without noise, of the chosen run, or of θ at the start, which is dotted beside a run. "
      + "Dashed line: the run laid over it. Thick line: first plan. Dashed circles: what plans keep away from at this {c}; "
      + "where two overlap, the gap is closed. Drag an obstacle, the robot, the target or the tip of an arrow; or click one and "
      + "then its new place; or reach it with Tab and press the arrow keys, with Shift for larger steps. Delete removes "
      + "an obstacle. The plots are of the runs among the chosen run’s obstacles; in those of costs, grey is the frozen arm: the "
      + "same noise, and θ never moves.",
    settings: "Settings",
    time: "Time of the closed loop",
    seconds: (time) => `${fixed(time, 1)} s`,
    policy: "Policy",
    afterEpisode: (episode) => (episode ? `after episode ${episode}` : "at the start"),
    keep: "Lay over",
    keepRun: (name) => `Lay ${name} over the chosen one`,
    lesson: "Lesson: the trap",
    back: "Back",
    next: "Next",
    step: (number, all, heading) => `Step ${number} of ${all}: ${heading}`,
    outcome: (run) => (run ? ended(run) : ""),
    // The steps of training.trap(): panels are those to look at; `found` says what became of both runs.
    trap: [
      {
        heading: "close the gap",
        panels: ["judged"],
        sentence: "{c} says how much farther than it must a plan stays from obstacles. Nothing learns here: in one run {c} is raised by "
          + "hand, and the dashed circles overlap; the dashed trajectory is that of {c} at the start. Look at where the two robots end.",
        found: (run, other) => `${ended(run)} ${ended(other)}`,
      },
      {
        heading: "let learning close it",
        panels: ["theta", "judged"],
        sentence: "Now {c} begins low, the gap is open, and ES learns. Look at {c} and at the cost without noise while it trains.",
        found: ({ first, closed, last }) => (
          closed ? `After ${closed.episode} episodes {c} is ${fixed(closed.thetaC, 3)}, and the robot does not arrive: the cost without noise is `
            + `${fixed(closed.cost, 0)}, and was ${fixed(first.cost, 0)}. After ${last.episode} it is ${fixed(last.cost, 0)}.`
            : `The gap stays open for ${last.episode} episodes.`
        ),
      },
      {
        heading: "is the value wrong?",
        panels: ["value", "judged"],
        replay: true,
        sentence: "The same run, its policies one after the other. Compare the two lines of “V and discounted cost”: V, what the NMPC’s "
          + "value says of the start, and the discounted cost that the robot then pays.",
        found: ({ first, closed, last }) => (
          `V and that cost are ${apart(first)} apart at the start, ${closed ? `${apart(closed)} once the gap is closed, ` : ""}`
          + `and ${apart(last)} at the end, where the cost without noise is ${fixed(last.cost, 0)} instead of ${fixed(first.cost, 0)}. `
          + `${closed && last.error < closed.error && last.cost > closed.cost
            ? "The value got more accurate while the policy got worse: all that is asked of V is to fit what the robot pays." : ""}`
        ),
      },
      {
        heading: "a smaller step",
        panels: ["theta", "judged"],
        sentence: "A remedy? α is a tenth. The dashed lines are the run before. Look at whether {c} stops, or only comes later.",
        found: (run) => `${ended(run)} ${run.closed ? `The gap is closed after episode ${run.closed.episode}.` : "The gap stays open."}`,
      },
      {
        heading: "another learner",
        panels: ["theta", "judged"],
        sentence: "A remedy? TDC follows the exact gradient of the projected error, with the second derivatives that GES leaves out. Look at {c}.",
        found: (run) => `${ended(run)} ${run.closed ? `The gap is closed after episode ${run.closed.episode}.` : "The gap stays open."}`,
      },
      {
        heading: "one number by hand",
        panels: ["judged"],
        sentence: "A remedy? Nothing learns; {c} is set once, below where the gap closes. The dashed trajectory is where ES ended.",
        found: (run, other) => `${ended(run)} ${ended(other)}`,
      },
    ],
    target: "Target",
    targetHeading: "Target, heading",
    add: "Add an obstacle",
    remove: "Remove the last one",
    reset: "Reset all",
    gallery: "A lesson, and finds: each trains and plays",
    names: {
      learner: "Learner", alpha: "Step size α", beta: "Step size β", beta_tdc: "Step size β", zeta: "Learning rate ζ",
      decay: "Decay per", decay_rate: "Decay factor c", horizon: "Horizon N", seed: "Seed", episodes: "Episodes",
      theta_c: "{c} at the start",
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
    seeds: (count) => `${count} other seeds`,
    progress: "Episodes trained",
    training: (name, done, all) => `${name}: episode ${done} of ${all}`,
    arm: (name) => `frozen arm of ${name}`,
    waiting: (count) => (count ? `; ${plural(count, "run")} waiting` : ""),
    run: (number, { learner, seed }, others) => [`${number}: ${learner}, seed ${seed}`, ...others].join(", "),
    other: {
      alpha: "α", beta: "β", beta_tdc: "β", zeta: "ζ", decay: "decay per", decay_rate: "c", horizon: "N",
      episodes: "episodes",
    },
    startingAt: (thetaC) => `{c} ${thetaC} at the start`,
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
    noRuns: "Press Train, or choose a find or the lesson. Then six curves grow here with every episode: of the cost, of θ, and of "
      + "what the value says.",
    plots: {
      judged: {
        title: "Cost without noise",
        label: "Cost of rollouts without noise over episodes, for each run and for the frozen arm",
      },
      value: {
        title: "V and discounted cost",
        label: "What the value says of the start, and the discounted cost of a rollout without noise, over the episodes of the chosen run",
      },
      theta: {
        title: "θ of the chosen run",
        label: "Components of theta after each episode of the chosen run; the four that move most have names",
      },
      delta: {
        title: "TD error (rms)",
        label: "Root mean square of the TD error in each training episode, for each run",
      },
      cost: {
        title: "Cost of training",
        label: "Cost of each training episode, for each run and for the frozen arm under the same noise",
      },
      step: {
        title: "Largest α‖φ‖² (limit: 2)",
        label: "Largest alpha times the squared norm of phi of each episode, for each run, and the line at 2",
      },
    },
    now: ({ cost, discounted, plan, failed, states }, who) => [
      failed
        ? [`The solver found no plan at step ${states.length}; the closed loop ${who} ends there.`]
        : [`Closed loop ${who}: cost`, fixed(cost, 1)],
      ...(plan && !failed ? [[
        "Its start: value", fixed(plan.value, 1), "; discounted cost", fixed(discounted, 1), "; slope of the value in {c}",
        fixed(plan.features.at(-1), 1),
      ]] : []),
    ],
    atStart: "with θ at the start",
    ofRun: (number, episode) => `with θ of run ${number} after episode ${episode}`,
    over: (number) => `laid over, with the last θ of run ${number}`,
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
