// The live figure of published runs: choose two, and move through their episodes. Some runs are given with the figure, the
// others are in a file of each layout; nmpcrl/report/live/published_runs.py makes both.
//
// What can be moved is `given`: { first, second, layout, decay, seed, component, episode }.
(() => {
  "use strict";

  const {
    add, unpack, plane, mapParts, choice, chart, extent, trace, key, player, numbers: { fixed, points }, parts: shared,
  } = window.nmpcrl;
  const PACE = 60; // from one episode to the next while it plays [ms]
  const KEPT = 100; // closed loops, at most
  const LEAST = 0.97, MOST = 1.3; // of the axes of costs: times the least of all, times theta_init's
  const CHOICES = { first: "Learner", second: "Beside it", layout: "Layout", decay: "Noise decays", seed: "Seed", component: "Weight" };
  const CHARTS = { training: "Cost of a training episode, with noise", costs: "Cost without noise", weight: "A weight, over the episodes" };
  const NAMES = { frozen: "no learning", random: "random directions", matched: "matched steps", QL: "Q-learning" };
  const LETTERS = { heading: "phi", heading_f: "phi f", x_f: "x f", y_f: "y f" }; // of weights, in a menu

  const named = (learner) => NAMES[learner] ?? learner;
  const missed = (learner, { layout, decay, seed }) => (
    `There is no run of ${named(learner)} in layout ${layout} with noise that decays per ${decay} and seed ${seed}.`
  );
  function option(name, value) {
    if (name === "decay") return `per ${value}`;
    if (name === "component") return `theta ${LETTERS[value] ?? value}`;
    return value === "" ? "none" : named(value);
  }

  const FOLDER = document.currentScript.src.replace(/[^/]*$/, ""); // "" in a notebook, which has no files

  // Numbers of single precision from how the bits of each differ from those before, all first bytes of these
  // before all second ones.
  function singles(planes) {
    const count = planes.length / 4, bits = new Uint32Array(count);
    let last = 0;
    for (let k = 0; k < count; k++) {
      for (let byte = 0; byte < 4; byte++) last += planes[byte * count + k] * 256 ** byte;
      last %= 2 ** 32;
      bits[k] = last;
    }
    return new Float32Array(bits.buffer);
  }

  // The runs of a layout by their names: training costs, costs without noise by evaluation, and theta by episode,
  // the 0th included; not a number where a run was stopped before, and where theta is not known.
  async function runsOf({ runs, numbers }, { episodes, names }) {
    const all = singles(new Uint8Array(await unpack(numbers)));
    const size = all.length / runs.length, trained = episodes.at(-1), theta = trained + episodes.length;
    return Object.fromEntries(runs.map((name, k) => {
      const part = (from, to) => Array.from(all.subarray(k * size + from, k * size + to));
      return [name, {
        training: part(0, trained),
        costs: part(trained, theta),
        theta: Array.from({ length: trained + 1 }, (_, episode) => (
          names.map((_, i) => all[k * size + theta + i * (trained + 1) + episode]))),
      }];
    }));
  }

  async function published(data) {
    const { chosen, looks, layouts, decays, seeds, names } = data;
    const known = { [chosen.layout]: await runsOf(data.given, data) };
    const whole = {}; // layouts of which all runs are there, or soon will be
    const learners = Object.keys(looks).filter((name) => name !== "frozen");
    const offered = {
      first: learners,
      second: ["", ...learners],
      layout: FOLDER ? Object.keys(layouts) : [chosen.layout],
      decay: decays,
      seed: FOLDER ? seeds : [chosen.seed],
      component: names,
    };
    const find = ({ layout, decay, seed }, learner) => known[layout]?.[`${learner} ${decay} ${seed}`];
    const more = (layout) => FOLDER !== "" && whole[layout] !== true;

    function load(layout) {
      whole[layout] ??= new Promise((done, failed) => {
        const script = add(document.head, "script", { src: `${FOLDER}runs_${layout}.js` });
        script.addEventListener("error", failed);
        script.addEventListener("load", async () => {
          known[layout] = await runsOf(window.nmpcrl.packed[layout], data);
          whole[layout] = true;
          done();
        });
      });
      return whole[layout];
    }

    return { offered, find, more, load };
  }

  const finite = (numbers) => numbers.filter(Number.isFinite);

  function choices(parent, offered, move) {
    const row = add(parent, "div", { class: "choices" });
    const all = Object.entries(offered).map(([name, options]) => {
      const kind = { label: CHOICES[name], options, text: (value) => option(name, value) };
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
      for (const { states, look } of found) trace(lines, "polyline", { points: points(states) }, look);
    };
  }

  // Three charts over the episodes: both costs, and a component of theta.
  function charts(parent, { episodes, names }) {
    const row = add(parent, "div", { class: "plots" }), x = [0, episodes.at(-1)];
    const [training, judged, weight] = Object.values(CHARTS).map((label) => chart(row, { label }));
    const least = (rows) => LEAST * Math.min(...finite(rows.flat()));
    return (found, { component, episode }) => {
      const lines = (points) => found.map(({ look, run }) => ({ ...look, points: points(run) }));
      const baseline = found.find(({ learner }) => learner === "frozen").run, cursor = episode;
      training.draw({
        x, cursor, y: [least(found.map(({ run }) => run.training)), Math.max(...finite(baseline.training))],
        lines: lines((run) => run.training.map((cost, k) => [k + 1, cost])),
      });
      judged.draw({
        x, cursor, y: [least(found.map(({ run }) => run.costs)), MOST * baseline.costs[0]],
        lines: lines((run) => run.costs.map((cost, k) => [episodes[k], cost])),
      });
      const k = names.indexOf(component), known = (run) => run.theta.map((theta, at) => [at, theta[k]]).filter(([, y]) => Number.isFinite(y));
      weight.head.replaceChildren();
      shared.write(weight.head, `{${component}}`);
      const drawn = lines(known);
      weight.draw({ x, cursor, y: extent(drawn.flatMap(({ points }) => points.map(([, y]) => y))), lines: drawn, across: "episodes" });
    };
  }

  function keys(parent) {
    const line = add(parent, "p", { class: "key" });
    return (found) => {
      line.replaceChildren();
      for (const { learner, look } of found) key(line, named(learner), look);
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

  // A line a run, of texts and numbers in turn.
  const results = (found, episode) => found.map(({ learner, theta, training, judged, failed, states }) => {
    const name = `${named(learner)}:`;
    if (!theta.every(Number.isFinite)) return [`${name} this run was stopped before episode ${episode}.`];
    const cost = failed ? [`; without noise: no plan was found at step ${states.length}`] : ["; without noise", fixed(judged, 1)];
    if (!episode) return [`${name} before training`, "", ...cost];
    return [`${name} cost of episode ${episode}`, Number.isFinite(training) ? fixed(training, 1) : "cut short", ...cost];
  });

  async function build(figure, data, { rollout }) {
    const runs = await published(data), loop = loops(data, rollout), last = data.episodes.at(-1);
    const begin = { ...data.chosen, component: "c", episode: last };
    const { read, move } = shared.state(begin, show);
    shared.heading(figure, {
      label: "Published runs: their trajectories, costs and parameters, episode by episode",
      title: "Try it: follow published runs from the first episode to the last.",
      hint: "Choose one or two runs. Then press Play, or move the slider by mouse, finger or arrow keys. The robot "
        + "follows the controller of that episode, solved in your browser.",
    });
    const choose = choices(figure, runs.offered, move);
    const { draw: play } = player(figure, {
      label: "Episode", last, pace: PACE, text: (episode) => `episode ${episode}`,
    }, { read: () => read().episode, write: (episode) => move({ episode }) });
    const scene = add(figure, "div", { class: "scene" });
    const map = plane(scene, data.view, "Map of the trajectories");
    mapParts.background(map, data);
    const draw = trajectories(map, data);
    const drawCharts = charts(figure, data), drawKeys = keys(figure);
    const tell = shared.results(figure);
    add(figure, "p", { class: "legend" }, `Map: ${data.steps} steps without noise; dashed circles are the obstacles' safety `
      + "distance. Lines run over the episodes, and end where a run was stopped. The axis of the training cost ends at the "
      + "highest of the run that does not learn, that of the cost without noise at 1.3 times the cost at the start; a line "
      + "that leaves its axis goes on beyond it.");

    function show(given) {
      choose(given);
      play(given.episode);
      const wanted = [...new Set([given.first, given.second, "frozen"])].filter(Boolean);
      const has = (learner) => Boolean(runs.find(given, learner));
      if (!wanted.every(has) && runs.more(given.layout)) {
        runs.load(given.layout).then(() => show(read()), () => tell([["The runs of this layout could not be loaded."]]));
        return;
      }
      const found = wanted.filter(has)
        .map((learner) => drawn(runs.find(given, learner), learner, given, data, loop));
      draw(data.layouts[given.layout], found);
      drawKeys(found);
      drawCharts(found, given);
      const missing = wanted.filter((learner) => !has(learner)).map((learner) => [missed(learner, given)]);
      tell([...missing, ...results(found, given.episode)]);
      figure.shown = { given, found }; // for whoever asks; tests do
    }
    show(begin);
  }

  shared.begin("runs", build);
})();
