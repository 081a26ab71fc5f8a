// The live figures of two learners on the robot, ES and GES or DES and RDES: choose alpha, the decay and the seed,
// and train both side by side.
//
// What can be moved is `given`: { alpha, decay, seed }; whatever moves it, training begins anew.
(() => {
  "use strict";

  const {
    add, solver, slider, choice, normal, judgeOf, learner, sideBySide, slices, learnersShown: shown,
    parts: shared, words: { learners: words },
  } = window.nmpcrl;
  const still = matchMedia("(prefers-reduced-motion: reduce)");

  // ---- What is chosen

  function settings(parent, { decays, seeds, alphas }, move) {
    const row = add(parent, "div", { class: "choices" });
    const menus = Object.entries({ decay: decays, seed: seeds }).map(([name, options]) => {
      const kind = { label: words.choices[name], options, text: words.option };
      return choice(row, kind, { read: (given) => given[name], write: (value) => move({ [name]: value }) });
    });
    const alpha = slider(add(row, "div", { class: "long" }), {
      name: "alpha", label: words.alpha, range: alphas, text: (power) => words.size(10 ** power),
    }, {
      read: (given) => Math.log10(given.alpha),
      write: (power) => move({ alpha: Number((10 ** power).toPrecision(3)) }),
    });
    return (given) => [...menus, alpha].forEach((draw) => draw(given));
  }

  // ---- The figure

  async function build(figure, data, nmpc) {
    const each = Object.values(data.settings), own = words.of[figure.dataset.figure];
    const solvers = await Promise.all(each.map(() => solver(window.nmpcrl.module, data.problem)));
    const [{ episodes, steps }] = each; // the same for both
    const judge = judgeOf(nmpc, each[0]);
    let begun = null; // both learners, from what was given

    function anew(given) {
      const { deviation, widths } = data.noise;
      const noise = normal(given.seed, episodes * steps * data.problem.lower.length, widths);
      const scaled = noise.map((number) => deviation * number);
      begun = sideBySide(each.map((fixed, k) => learner(solvers[k], { ...fixed, ...given }, scaled, judge)));
    }

    const { read, move } = shared.state(data.given, (given) => {
      training.stop();
      anew(given);
      show();
    });
    shared.heading(figure, own);
    const chosen = settings(figure, data, move);
    const row = add(figure, "div", { class: "buttons" });
    const press = (name, act) => shared.button(row, words.buttons[name], act);
    const train = press("train", () => (training.running() ? training.stop() : training.begin()));
    const some = ["wholeEpisode", "step"].map((name) => press(name, () => {
      training.stop();
      if (!begun.over()) begun[name]();
      show();
    }));
    press("reset", () => move(data.given));
    const line = add(row, "label", { class: "done" });
    const bar = add(line, "progress", { max: episodes, "aria-label": words.progress }), count = add(line, "span");
    shown.keys(figure, data);
    const sides = add(figure, "div", { class: "sides" });
    const places = shown.map(add(sides, "div"), data, own.map), numbers = add(sides, "div");
    const parts = data.parts.map((name) => shown[name](numbers, data));
    parts.push(shown.charts(figure, data));
    add(figure, "p", { class: "legend" }, [words.legend(each[0]), ...data.charts.map((name) => words.axes[name])].join(" "));
    if (own.question) shared.write(add(figure, "p"), own.question);
    const say = shared.results(figure);

    const training = slices({
      work: () => !begun.over() && begun.step(),
      pause: () => (still.matches ? progress() : show()),
      rest: () => show(),
    });

    function progress() {
      const done = Math.max(...begun.all.map(({ episode }) => episode));
      bar.value = done;
      count.textContent = words.done(done, episodes);
      train.textContent = words.buttons[training.running() ? "stop" : "train"];
    }

    function show() {
      const found = begun.all, running = training.running();
      progress();
      chosen(read());
      // while it trains, the policies last judged; then those of the weights now
      const policies = found.map(({ theta, costs }) => (running ? costs.at(-1) : judge(theta)).states);
      for (const draw of parts) draw(found);
      places(found, policies);
      for (const button of [train, ...some]) button.disabled = begun.over();
      say(found.map((now) => words.result(now, data.charts)));
      figure.shown = { given: read(), found }; // for whoever asks; tests do
    }
    anew(data.given);
    show();
  }

  for (const name of Object.keys(words.of)) shared.begin(name, build);
})();
