// Every word that a reader of the figures of two learners sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed, power, sized } = words.parts;

  // A large number with one digit, where there is little room.
  function coarse(number) {
    if (!Number.isFinite(number)) return sized(number);
    const [digit, exponent] = number.toExponential(0).split("e");
    return `${digit.replace("-", "\u2212")}\u00b7${power(Number(exponent))}`;
  }

  const training = "Press Train, and Stop when you like; or go on by one episode or one step of both. "
    + "Whatever you choose anew, training begins again.";

  words.learners = {
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
    buttons: { train: "Train", stop: "Stop", wholeEpisode: "One episode", step: "One step", reset: "Reset all" },
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
    weight: (number) => (Math.abs(number) < 100 ? fixed(number, 3) : coarse(number)),
    charts: {
      costs: ({ every }) => `Cost without noise, every ${every} episodes`,
      gauges: ({ overshoot }) => `Largest α‖φ‖² of each episode; dotted: ${overshoot}`,
      errors: () => "Error of the predicted next value, each episode",
    },
    cost: (number) => fixed(number, 0),
    power,
    legend: ({ steps, evaluateEvery: every }) => `The map shows ${steps} steps without noise, anew after every ${every} `
      + "episodes; circles are the robot in training.",
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
        const shown = error < 10000 ? fixed(error, 1) : sized(error);
        texts.push(`; error of the next value in episode ${errors.length}`, shown);
      }
      return diverged ? [...texts, `; diverged in episode ${episode}`] : texts;
    },
  };
})();
