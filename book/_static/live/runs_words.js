// Every word that a reader of the figure of published runs sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed, sliders } = words.parts;

  const names = {
    frozen: "frozen arm", random: "random directions", matched: "matched steps", QL: "Q-learning",
  };

  const named = (learner) => names[learner] ?? learner;

  words.runs = {
    map: "Published runs: their trajectories, costs and parameters, episode by episode",
    title: "Try it: follow published runs from the first episode to the last.",
    hint: "Choose one or two runs. Then press Play, or move the slider by mouse, finger or arrow keys. The robot "
      + "follows the controller of that episode, solved in your browser.",
    choices: { first: "Learner", second: "Beside it", layout: "Layout", decay: "Noise decays", seed: "Seed" },
    option: (name, value) => {
      if (name === "decay") return `per ${value}`;
      return value === "" ? "none" : named(value);
    },
    slider: "Episode",
    after: (episode) => `episode ${episode}`,
    charts: { training: "Cost of a training episode, with noise", costs: "Cost without noise" },
    theta: (name) => `${sliders[name]}, over the episodes`,
    cost: (number) => fixed(number, 0),
    weight: (number) => (Math.abs(number) < 1000 ? fixed(number, Math.abs(number) < 1 ? 3 : 2) : number.toExponential(1)),
    missing: (learner, { layout, decay, seed }) => (
      `There is no run of ${named(learner)} in layout ${layout} with noise that decays per ${decay} and seed ${seed}.`
    ),
    absent: "The runs of this layout could not be loaded.",
    results: (found, episode) => found.map(({ learner, theta, training, judged, failed, states }) => {
      const name = `${named(learner)}:`;
      if (!theta.every(Number.isFinite)) return [`${name} this run was stopped before episode ${episode}.`];
      const cost = failed ? [`; without noise: no plan was found at step ${states.length}`]
        : ["; without noise", fixed(judged, 1)];
      if (!episode) return [`${name} before training`, "", ...cost];
      return [`${name} cost of episode ${episode}`, Number.isFinite(training) ? fixed(training, 1) : "cut short", ...cost];
    }),
    legend: (steps) => `Map: ${steps} steps without noise; dashed circles are the obstacles' safety distance. `
      + "Lines run over the episodes, and end where a run was stopped. The axis of the training cost ends at the "
      + "highest of the frozen arm, that of the cost without noise at 1.3 times the cost at the start; a line that "
      + "leaves its axis goes on beyond it.",
  };
})();
