// The live figure of published runs: choose two, and move through their episodes.
//
// What can be moved is `given`: { first, second, layout, decay, seed, episode }.
(() => {
  "use strict";

  const {
    add, plane, mapParts, choice, chart, trace, key, player, published, parts: shared, words: { runs: words },
  } = window.nmpcrl;
  const PACE = 60; // from one episode to the next while it plays [ms]
  const KEPT = 100; // closed loops, at most
  const LEAST = 0.97, MOST = 1.3; // of the axes of costs: times the least of all, times theta_init's

  const finite = (numbers) => numbers.filter(Number.isFinite);

  function choices(parent, offered, move) {
    const row = add(parent, "div", { class: "choices" });
    const all = Object.entries(offered).map(([name, options]) => {
      const kind = { label: words.choices[name], options, text: (value) => words.option(name, value) };
      return choice(row, kind, { read: (given) => given[name], write: (value) => move({ [name]: value }) });
    });
    return (given) => all.forEach((draw) => draw(given));
  }

  function trajectories(map, data) {
    const discs = add(map.ground, "g");
    const lines = add(map.ground, "g");
    mapParts.target(map, data);
    return (centres, found) => {
      discs.replaceChildren();
      centres.forEach((disc, k) => mapParts.circles(discs, disc, data.radii[k]));
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
      const known = (run) => run.theta.map((theta, episode) => [episode, theta[k]])
        .filter(([, number]) => Number.isFinite(number));
      const drawn = found.map(({ run, look }) => ({ look, points: known(run) }));
      const numbers = drawn.flatMap(({ points }) => points.map(([, number]) => number));
      one.draw(drawn, [Math.min(...numbers), Math.max(...numbers)], words.weight);
    });
    return { lines, point: (x) => all.forEach((one) => one.point(x)) };
  }

  function keys(parent) {
    const line = add(parent, "p", { class: "key" });
    return (found) => {
      line.replaceChildren();
      for (const { learner, look } of found) key(line, words.option("first", learner), look);
    };
  }

  // The closed loop of theta in a layout, solved once; there is none where a run had been stopped before.
  function loops({ start, horizon, steps, layouts }, rollout) {
    const known = new Map();
    return (theta, layout) => {
      if (!theta.every(Number.isFinite)) return { states: [], cost: NaN };
      const name = `${layout} ${theta}`;
      if (known.size === KEPT) known.clear();
      if (!known.has(name)) known.set(name, rollout({ start, horizon, theta, discs: layouts[layout] }, steps));
      return known.get(name);
    };
  }

  // What is drawn of a run after an episode; its cost without noise is the published one where there is one.
  function drawn(run, learner, { episode, layout }, { looks, episodes }, loop) {
    const theta = run.theta[episode], solved = loop(theta, layout), evaluation = episodes.indexOf(episode);
    const judged = evaluation < 0 ? solved.cost : run.costs[evaluation];
    return { learner, look: looks[learner], run, theta, judged, training: run.training[episode - 1], ...solved };
  }

  async function build(figure, data, { rollout }) {
    const runs = await published(data), loop = loops(data, rollout), last = data.episodes.at(-1);
    const begin = { ...data.chosen, episode: last };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, words);
    const choose = choices(figure, runs.offered, move);
    const { draw: play } = player(figure, {
      label: words.slider, last, pace: PACE, text: words.after,
    }, { read: () => read().episode, write: (episode) => move({ episode }) });
    const scene = add(figure, "div", { class: "scene" });
    const map = plane(scene, data.view, words.map);
    mapParts.background(map, data);
    const draw = trajectories(map, data);
    const curves = [costs(scene, data), thetas(figure, data)];
    const named = keys(figure);
    const tell = shared.results(figure);
    add(figure, "p", { class: "legend" }, words.legend(data.steps));
    let before = "";

    function show(given) {
      choose(given);
      play(given.episode);
      const wanted = [...new Set([given.first, given.second, "frozen"])].filter(Boolean);
      const has = (learner) => Boolean(runs.find(given, learner));
      if (!wanted.every(has) && runs.more(given.layout)) {
        runs.load(given.layout).then(() => show(read()), () => tell([[words.absent]]));
        return;
      }
      const found = wanted.filter(has)
        .map((learner) => drawn(runs.find(given, learner), learner, given, data, loop));
      draw(data.layouts[given.layout], found);
      const cell = JSON.stringify({ ...given, episode: 0 });
      if (cell !== before) {
        named(found);
        for (const { lines } of curves) lines(found);
      }
      before = cell;
      for (const { point } of curves) point(given.episode);
      const missing = wanted.filter((learner) => !has(learner)).map((learner) => [words.missing(learner, given)]);
      tell([...missing, ...words.results(found, given.episode)]);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("runs", build);
})();
