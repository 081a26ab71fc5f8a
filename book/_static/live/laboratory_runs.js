// The laboratory's runs: a queue that trains one after the other, and their list.
(() => {
  "use strict";

  const { add, set, trainer, finalCost, parts: shared, words: { laboratory: words } } = window.nmpcrl;
  const ARM = "frozen";

  // What the page is given to a run as `learning` takes it.
  function learned(given, data) {
    return {
      learner: given.learner, alpha: given.alpha, beta: given.learner === "TDC" ? given.beta_tdc : given.beta,
      zeta: given.zeta, limits: data.limits, network: data.network,
      decay: given.decay, decayRate: given.decay_rate, episodes: given.episodes, seed: given.seed,
      steps: data.steps, theta: given.theta, w: data.w, thetaSet: data.theta_set, evaluateEvery: data.evaluate_every,
      start: given.start, target: given.target, horizon: given.horizon,
      discs: given.layout.map((centre) => [...centre, data.clearance]),
    };
  }

  // Runs that are added train one after the other, each followed by its frozen arm; `changed()` follows each episode.
  function queue(data, changed) {
    const arms = new Map(); // rows of the frozen arms, by what they depend on
    const runs = [];
    let doing = null, count = 0; // { run, rows, stop }

    function begin(run, settings, rows, end) {
      const given = { module: window.nmpcrl.module, problem: data.problem, settings, widths: data.widths };
      const row = (each) => {
        rows.push(each);
        changed();
      };
      doing = { run, rows, stop: trainer(given, { row, end }) };
    }

    function next() {
      doing = null;
      const run = runs.find(({ state }) => state === "waiting");
      if (run) {
        run.state = "running";
        const settings = learned(run.given, data);
        begin(run, settings, run.rows, (why) => {
          if (!why) {
            run.state = run.rows.at(-1).diverged ? "diverged" : "finished";
            arm(run, settings);
          } else {
            run.state = "failed";
            run.why = words.failed(why);
            next();
          }
        });
      }
      changed();
    }

    function arm(run, settings) {
      const same = JSON.stringify({ ...settings, learner: ARM, alpha: 0, beta: 0, zeta: 0 });
      if (run.given.learner === ARM) arms.set(same, run.rows);
      run.arm = arms.get(same) ?? [];
      if (arms.has(same)) {
        next();
        return;
      }
      const rows = run.arm;
      begin(run, { ...settings, learner: ARM }, rows, (why) => {
        if (why) run.why = words.armFailed(why);
        else arms.set(same, rows);
        next();
      });
    }

    function stop() {
      doing?.stop();
      doing = null;
      for (const run of runs) if (run.state === "running" || run.state === "waiting") run.state = "stopped";
      changed();
    }

    return {
      runs,
      doing: () => doing,
      add(given) {
        const run = { number: ++count, given, rows: [], arm: [], state: "waiting", why: "" };
        runs.push(run);
        if (!doing) next();
        else changed();
        return run;
      },
      stop,
      remove(run) {
        runs.splice(runs.indexOf(run), 1);
        if (doing?.run !== run) return changed();
        doing.stop();
        return next();
      },
    };
  }

  const judged = (rows) => rows.filter((row) => row.judged);
  const hasEnded = ({ state }) => state !== "waiting" && state !== "running";

  // How a run has done: its costs without noise at the start and at the end.
  function verdict({ rows, state, why }, data) {
    const costs = judged(rows).map(({ judged: { cost } }) => cost), ended = why || words.ends[state];
    const end = state === "finished" ? finalCost(costs, data.last) : null;
    return [...(costs.length ? [words.cost(costs[0], end)] : []), ...(ended ? [ended] : [])].join("; ");
  }

  // A line a run: chosen by its radio button, laid over the chosen one and removed by its buttons.
  function list(parent, data, { choose, keep, remove, name }) {
    const all = add(parent, "ul", { class: "runs", "aria-label": words.runs });
    const nothing = add(parent, "p", { class: "hint" }, words.none);
    const items = new Map();

    function item(run) {
      const line = add(all, "li");
      const label = add(line, "label");
      const input = add(label, "input", { type: "radio", name: "nmpcrl-run" });
      const swatch = add(label, "span", { class: "swatch" });
      swatch.style.setProperty("--look", data.looks[run.given.learner].color);
      shared.write(add(label, "span"), name(run));
      const found = add(line, "span", { class: "found" });
      input.addEventListener("change", () => choose(run));
      const over = shared.button(line, words.keep, () => keep(run));
      set(over, { "aria-label": shared.plain(words.keepRun(name(run))) });
      const button = shared.button(line, words.removeShort, () => remove(run));
      set(button, { "aria-label": shared.plain(words.removeRun(name(run))) });
      return { line, input, found, over };
    }

    return (runs, chosen, kept) => {
      nothing.hidden = runs.length > 0;
      for (const [run, { line }] of items) {
        if (runs.includes(run)) continue;
        line.remove();
        items.delete(run);
      }
      for (const run of runs) {
        if (!items.has(run)) items.set(run, item(run));
        const { input, found, over } = items.get(run), text = verdict(run, data);
        input.checked = run === chosen;
        set(over, { "aria-pressed": run === kept });
        if (found.textContent !== text) found.textContent = text;
      }
    };
  }

  window.nmpcrl = { ...window.nmpcrl, laboratoryRuns: { queue, list, judged, hasEnded } };
})();
