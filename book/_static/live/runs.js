// The live figure of published runs: choose two, and move through their episodes.
//
// What can be moved is `given`: { first, second, layout, decay, seed, at }, where `at` counts evaluations.
(() => {
  "use strict";

  const { add, set, plane, chart, trace, published, parts: shared, words: { runs: words } } = window.nmpcrl;
  const PACE = 350; // from one evaluation to the next while it plays [ms]
  const LEAST = 0.97, MOST = 1.3; // of the axes of costs: times the least of all, times theta_init's

  const finite = (numbers) => numbers.filter(Number.isFinite);
  function choice(row, name, options, move) {
    const line = add(row, "label", { class: "choice" });
    add(line, "span", {}, words.choices[name]);
    const select = add(line, "select", { "aria-label": words.choices[name] });
    for (const value of options) add(select, "option", { value }, words.option(name, value));
    select.addEventListener("change", () => move({ [name]: name === "seed" ? Number(select.value) : select.value }));
    return (given) => { select.value = given[name]; };
  }

  function choices(parent, offered, move) {
    const row = add(parent, "div", { class: "choices" });
    const all = Object.entries(offered).map(([name, options]) => choice(row, name, options, move));
    return (given) => all.forEach((draw) => draw(given));
  }

  // A slider, and a button that moves it to the end.
  function player(parent, episodes, read, move) {
    const row = add(parent, "div", { class: "player" });
    const play = add(row, "button", { type: "button" }, words.play);
    const last = episodes.length - 1;
    const range = add(row, "input", { type: "range", min: 0, max: last, step: 1, "aria-label": words.slider });
    const value = add(row, "span", { class: "value" });
    let timer = 0;
    const stop = () => {
      clearInterval(timer);
      timer = 0;
      play.textContent = words.play;
    };
    const next = () => {
      if (read().at < last) move({ at: read().at + 1 });
      if (read().at >= last) stop();
    };
    play.addEventListener("click", () => {
      if (timer) return stop();
      if (read().at === last) move({ at: 0 });
      timer = setInterval(next, PACE);
      play.textContent = words.pause;
    });
    range.addEventListener("input", () => {
      stop();
      move({ at: Number(range.value) });
    });
    return ({ at }) => {
      range.value = at;
      value.textContent = words.after(episodes[at]);
      set(range, { "aria-valuetext": value.textContent });
    };
  }

  function trajectories(map, { radii, problem: { target: [x, y] } }) {
    const discs = add(map.ground, "g");
    const lines = add(map.ground, "g");
    add(map.ground, "circle", { class: "target", cx: x, cy: y });
    map.write(words.target, x, y, { class: "name" });
    return (centres, found) => {
      discs.replaceChildren();
      centres.forEach(([cx, cy, clearance], k) => {
        add(discs, "circle", { class: "safety", cx, cy, r: clearance / 2 });
        add(discs, "circle", { class: "disc", cx, cy, r: radii[k] });
      });
      lines.replaceChildren();
      for (const { states, look } of found) trace(lines, "polyline", { points: shared.points(states) }, look);
    };
  }

  function costs(parent, { episodes }) {
    const row = add(parent, "div", { class: "costs" });
    const all = ["training", "costs"].map((name) => {
      const one = chart(row, { label: words.charts[name], last: episodes.at(-1) });
      one.title.textContent = words.charts[name];
      return one;
    });
    const [training, judged] = all;
    const least = (rows) => LEAST * Math.min(...finite(rows.flat()));
    const lines = (found) => {
      const drawn = (points) => found.map(({ look, run }) => ({ look, points: points(run) }));
      const frozen = found.find(({ learner }) => learner === "frozen").run;
      const limits = [least(found.map(({ run }) => run.training)), Math.max(...finite(frozen.training))];
      training.draw(drawn((run) => run.training.map((cost, k) => [k + 1, cost])), limits, words.cost);
      const range = [least(found.map(({ run }) => run.costs)), MOST * frozen.costs[0]];
      judged.draw(drawn((run) => run.costs.map((cost, k) => [episodes[k], cost])), range, words.cost);
    };
    return { lines, point: (x) => all.forEach((one) => one.point(x)) };
  }

  function thetas(parent, { names, episodes }) {
    const row = add(parent, "div", { class: "thetas" });
    const all = names.map((name) => {
      const one = chart(row, { label: words.theta(name), last: episodes.at(-1) });
      shared.symbol(one.title, name);
      return one;
    });
    const lines = (found) => all.forEach((one, k) => {
      const points = (run) => run.theta.map((theta, at) => [episodes[at], theta[k]]);
      const numbers = finite(found.flatMap(({ run }) => run.theta.map((theta) => theta[k])));
      const drawn = found.map(({ run, look }) => ({ look, points: points(run) }));
      one.draw(drawn, [Math.min(...numbers), Math.max(...numbers)], words.weight);
    });
    return { lines, point: (x) => all.forEach((one) => one.point(x)) };
  }

  function key(parent) {
    const line = add(parent, "p", { class: "key" });
    return (found) => {
      line.replaceChildren();
      for (const { learner, look } of found) {
        const item = add(line, "span");
        const svg = add(item, "svg", { viewBox: "0 0 34 4", "aria-hidden": true });
        trace(svg, "path", { d: "M0 2H34" }, look);
        item.append(words.option("first", learner));
      }
    };
  }

  // The closed loop of theta in a layout, solved once; there is none where a run had been stopped before.
  function loops({ start, horizon, steps, layouts }, rollout) {
    const known = {};
    return (theta, layout) => {
      if (!theta.every(Number.isFinite)) return { states: [] };
      return known[[layout, theta]] ??= rollout({ start, horizon, theta, discs: layouts[layout] }, steps);
    };
  }

  // What is drawn of a run.
  function drawn(run, learner, { at, layout }, { looks, episodes }, loop) {
    const theta = run.theta[at], judged = run.costs[at], training = run.training[episodes[at] - 1];
    return { learner, look: looks[learner], run, theta, judged, training, ...loop(theta, layout) };
  }

  function build(figure, data, { rollout }) {
    const runs = published(data), loop = loops(data, rollout);
    const begin = { ...data.chosen, at: data.episodes.length - 1 };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const choose = choices(figure, runs.offered, move);
    const play = player(figure, data.episodes, read, move);
    const scene = add(figure, "div", { class: "scene" });
    const map = plane(scene, data.view, words.map);
    shared.background(map, data);
    const draw = trajectories(map, data);
    const curves = [costs(scene, data), thetas(figure, data)];
    const named = key(figure);
    const tell = shared.results(figure);
    add(figure, "p", { class: "legend" }, words.legend(data.steps));
    let before = "";

    function show(given) {
      choose(given);
      play(given);
      const wanted = [...new Set([given.first, given.second, "frozen"])].filter(Boolean);
      const has = (learner) => Boolean(runs.find(given, learner));
      if (!wanted.every(has) && runs.more(given.layout)) {
        runs.load(given.layout).then(() => show(read()), () => tell([[words.absent]]));
        return;
      }
      const found = wanted.filter(has)
        .map((learner) => drawn(runs.find(given, learner), learner, given, data, loop));
      draw(data.layouts[given.layout], found);
      const cell = JSON.stringify({ ...given, at: 0 });
      if (cell !== before) {
        named(found);
        for (const { lines } of curves) lines(found);
      }
      before = cell;
      for (const { point } of curves) point(data.episodes[given.at]);
      const missing = wanted.filter((learner) => !has(learner)).map((learner) => [words.missing(learner, given)]);
      tell([...missing, ...words.results(found, data.episodes[given.at])]);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("runs", build);
})();
