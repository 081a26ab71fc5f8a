// Every word that a reader of the chain's figure sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed, power, sized } = words.parts;

  words.chain = {
    map: "The chain of two states, whose step sizes and discount can be moved",
    title: "Try it: the chain, updated in your browser by the functions that train the robot.",
    hint: "Move the sliders by mouse, finger or arrow keys. Press Step for one update, or Play for all.",
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
    reset: "Reset all",
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
})();
