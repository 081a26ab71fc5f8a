// The live figure of the chain of two states: choose step sizes, discount and the states that are updated,
// and follow theta update by update.
//
// What can be moved is `given`: { alpha, beta, gamma, states, at }, where `at` counts updates.
(() => {
  "use strict";

  const { add, slider, chart, key, player, parts: shared, words: { chain: words } } = window.nmpcrl;
  const PACE = 100; // of an update while it plays [ms]
  const FIRST = 0, SECOND = 1;
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
    const all = Object.entries(words.sliders).map(([name, label]) => {
      const kind = { name, label, range: ranges[name], text: words.number };
      return slider(add(row, "div"), kind, {
        read: (given) => given[name],
        write: (number) => move({ [name]: number }),
      });
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  function choice(parent, move) {
    const group = add(parent, "fieldset", { class: "options" });
    add(group, "legend", {}, words.states.legend);
    const row = add(group, "div");
    const all = ["first", "both"].map((value) => {
      const line = add(row, "label");
      const input = add(line, "input", { type: "radio", name: "chain-states", value });
      add(line, "span", {}, words.states[value]);
      input.addEventListener("change", () => move({ states: value }));
      return input;
    });
    return ({ states }) => all.forEach((input) => { input.checked = input.value === states; });
  }

  // Sizes over the updates on a logarithmic axis: what has happened, and pale what is to come.
  function sizes(parent, { updates, limits }, label, looks) {
    const one = chart(parent, { label, last: updates });
    one.title.className = "key";
    add(one.title, "span", {}, label);
    for (const [name, look] of Object.entries(looks)) key(one.title, words.keys[name], look);
    const log = (number) => Math.log10(Math.abs(number));
    const range = limits.map(log);
    return (at, lines) => {
      const drawn = Object.entries(lines).flatMap(([name, numbers]) => {
        const look = looks[name];
        const points = numbers.map((number, k) => [k, log(number)]);
        return [{ points, look: { ...look, pale: true } }, { points: points.slice(0, at + 1), look }];
      });
      one.draw(drawn, range, words.power);
      one.point(at);
    };
  }

  function build(figure, data, { rules }) {
    const begin = data.given;
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const parts = [choice(figure, move), sliders(figure, data, read, move)];
    const moved = { label: words.slider, last: data.updates, pace: PACE, text: words.after, steps: true };
    const playing = player(figure, moved, {
      read: () => read().at,
      write: (at) => move({ at }),
    });
    const row = add(figure, "div", { class: "costs" });
    const thetas = sizes(row, data, words.charts.theta, data.looks);
    const errors = sizes(row, data, words.charts.error, ERRORS);
    add(figure, "p", { class: "legend" }, words.legend);
    const say = shared.results(figure);
    const last = add(figure, "div", { class: "last" });
    add(last, "p", {}, words.question);
    shared.button(last, words.reset, () => {
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
      say(words.results({ ES, GES }, given));
      figure.shown = { given, found: { ES, GES } }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("chain", build);
})();
