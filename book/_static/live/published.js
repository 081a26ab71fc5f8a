// Published runs: some are given with the figure, the others are in a file of each layout.
// nmpcrl/report/live/published_runs.py makes both.
(() => {
  "use strict";

  const { add } = window.nmpcrl;
  const FOLDER = document.currentScript.src.replace(/[^/]*$/, ""); // "" in a notebook, which has no files

  // The runs of a layout by their names: numbers are the training costs, the costs without noise, and theta.
  function unpack({ runs, numbers }, { episodes, names }) {
    const bytes = Uint8Array.from(atob(numbers), (letter) => letter.charCodeAt(0));
    const all = new Float32Array(bytes.buffer);
    const size = all.length / runs.length, d = names.length, theta = size - episodes.length * d;
    const costs = theta - episodes.length;
    return Object.fromEntries(runs.map((name, k) => {
      const part = (from, to) => Array.from(all.subarray(k * size + from, k * size + to));
      return [name, {
        training: part(0, costs),
        costs: part(costs, theta),
        theta: episodes.map((_, at) => part(theta + at * d, theta + (at + 1) * d)),
      }];
    }));
  }

  function published(data) {
    const { chosen, looks, layouts, decays, seeds } = data;
    const known = { [chosen.layout]: unpack(data.given, data) };
    const whole = {}; // layouts of which all runs are there, or soon will be
    const learners = Object.keys(looks).filter((name) => name !== "frozen");
    const offered = {
      first: learners,
      second: ["", ...learners],
      layout: FOLDER ? Object.keys(layouts) : [chosen.layout],
      decay: decays,
      seed: FOLDER ? seeds : [chosen.seed],
    };
    const find = ({ layout, decay, seed }, learner) => known[layout]?.[`${learner} ${decay} ${seed}`];
    const more = (layout) => FOLDER !== "" && whole[layout] !== true;

    function load(layout) {
      whole[layout] ??= new Promise((done, failed) => {
        const script = add(document.head, "script", { src: `${FOLDER}runs_${layout}.js` });
        script.addEventListener("error", failed);
        script.addEventListener("load", () => {
          known[layout] = unpack(window.nmpcrl.packed[layout], data);
          whole[layout] = true;
          done();
        });
      });
      return whole[layout];
    }

    return { offered, find, more, load };
  }

  window.nmpcrl = { ...window.nmpcrl, published };
})();
