// The live figure of the chain of two states: choose step sizes, discount and the states that are updated,
// and follow theta update by update.
//
// What can be moved is `given`: { alpha, beta, gamma, states, at }, where `at` counts updates.
(() => {
  "use strict";

  const { add, slider, chart, key, player, button, numbers: { fixed, sized }, parts: shared } = window.nmpcrl;
  const PACE = 100; // of an update while it plays [ms]
  const FIRST = 0, SECOND = 1;
  const SLIDERS = { alpha: "alpha, step size of theta", beta: "beta, step size of w", gamma: "gamma, discount" };
  const STATES = { first: "in the first state only (off-policy)", both: "in both states in turn (on-policy)" };
  const KEYS = { ES: "semi-gradient", GES: "gradient TD", delta: "TD error δ", predicted: "prediction wφ" };
  const ERRORS = {
    delta: { color: "var(--ink)", dashes: "" },
    predicted: { color: "var(--plan)", dashes: "5 3" },
  };

  // Weights, and everything about the update that follows, before each update of a learner.
  function follow(rules, { alpha, beta, gamma, states }, data, learner) {
    let theta = [data.theta], w = [data.w];
    return Array.from({ length: data.updates + 1 }, (_, k) => {
      const state = states === "first" || k % 2 === 0 ? FIRST : SECOND;
      const phi = data.phi[state], phiNext = data.phi_next[state];
      const value = phi[0] * theta[0];
      const delta = rules.tdError(data.cost, gamma, value, phiNext[0] * theta[0]);
      const now = { theta: theta[0], w: w[0], state, value, target: value + delta, delta, predicted: w[0] * phi[0] };
      if (learner === "ES") {
        theta = rules.semiGradient(theta, delta, phi, alpha);
      } else {
        ({ theta, w } = rules.gradientTd({ theta, w, delta, phi, phiNext, alpha, beta, gamma }));
      }
      return now;
    });
  }

  function sliders(parent, { ranges }, read, move) {
    const row = add(parent, "div", { class: "groups" });
    const all = Object.entries(SLIDERS).map(([name, label]) => {
      const kind = { name, label, range: ranges[name], text: (value) => fixed(value, 2) };
      return slider(add(row, "div"), kind, {
        read: (given) => given[name],
        write: (number) => move({ [name]: number }),
      });
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  function choice(parent, move) {
    const group = add(parent, "fieldset", { class: "options" });
    add(group, "legend", {}, "Updates are made");
    const row = add(group, "div");
    const all = ["first", "both"].map((value) => {
      const line = add(row, "label");
      const input = add(line, "input", { type: "radio", name: "chain-states", value });
      add(line, "span", {}, STATES[value]);
      input.addEventListener("change", () => move({ states: value }));
      return input;
    });
    return ({ states }) => all.forEach((input) => { input.checked = input.value === states; });
  }

  // Sizes over the updates on a logarithmic axis: what has happened, and pale what is to come.
  function sizes(parent, { updates, limits }, label, looks) {
    const one = chart(parent, { label });
    one.head.className = "key caption";
    for (const [name, look] of Object.entries(looks)) key(one.head, KEYS[name], look);
    return (at, numbers) => {
      const lines = Object.entries(numbers).flatMap(([name, sizes]) => {
        const look = looks[name], points = sizes.map((size, k) => [k, size || NaN]);
        return [{ ...look, points, pale: true }, { ...look, points: points.slice(0, at + 1) }];
      });
      one.draw({ x: [0, updates], y: limits, logs: "y", lines, cursor: at, across: "updates" });
    };
  }

  // Lines of texts and numbers in turn.
  const results = ({ ES, GES }, { alpha, beta, at }) => [
    [
      "Semi-gradient: θ =", sized(ES[at].theta), "; value of the state that is updated next", sized(ES[at].value),
      "; its target", sized(ES[at].target), "; δ =", sized(ES[at].delta),
    ],
    [
      "Gradient TD: θ =", sized(GES[at].theta), "; w =", sized(GES[at].w), "; value", sized(GES[at].value),
      "; target", sized(GES[at].target), "; δ =", sized(GES[at].delta), "; predicted: wφ =", sized(GES[at].predicted),
    ],
    [
      `After ${ES.length - 1} updates, with β / α =`, fixed(beta / alpha, 2), "; θ of the semi-gradient",
      sized(ES.at(-1).theta), "; of gradient TD", sized(GES.at(-1).theta),
    ],
  ];

  function build(figure, data, { rules }) {
    const begin = data.given;
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, {
      label: "The chain of two states, whose step sizes and discount can be moved",
      title: "Try it: the chain, updated in your browser by the functions that train the robot.",
      hint: "Move the sliders by mouse, finger or arrow keys. Press Step for one update, or Play for all.",
    });
    const parts = [choice(figure, move), sliders(figure, data, read, move)];
    const moved = { 
      label: "Updates made", last: data.updates, pace: PACE, steps: true,
      text: (updates) => `after ${updates} update${updates === 1 ? "" : "s"}`,
     };
    const playing = player(figure, moved, {
      read: () => read().at,
      write: (at) => move({ at }),
    });
    const row = add(figure, "div", { class: "costs" });
    const thetas = sizes(row, data, "|θ| over the updates:", data.looks);
    const errors = sizes(row, data, "Gradient TD, in absolute value:", ERRORS);
    add(figure, "p", { class: "legend" }, "Logarithmic axes: a dip is a change of sign; a line that leaves an axis goes on "
      + "beyond it. Pale: what is still to come.");
    const say = shared.results(figure);
    const last = add(figure, "div", { class: "last" });
    add(last, "p", {}, "How small may β be before gradient TD diverges, too? And what changes with updates in both states?");
    button(last, "Reset all", () => {
      playing.stop();
      move(begin);
    });

    function show(given) {
      const ES = follow(rules, given, data, "ES"), GES = follow(rules, given, data, "GES");
      const all = (path, name) => path.map((now) => now[name]);
      thetas(given.at, { ES: all(ES, "theta"), GES: all(GES, "theta") });
      errors(given.at, { delta: all(GES, "delta"), predicted: all(GES, "predicted") });
      playing.draw(given.at);
      for (const draw of parts) draw(given);
      say(results({ ES, GES }, given));
      figure.shown = { given, found: { ES, GES } }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("chain", build);
})();
