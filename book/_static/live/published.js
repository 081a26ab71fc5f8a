// Published runs: some are given with the figure, the others are in a file of each layout.
// nmpcrl/report/live/published_runs.py makes both.
(() => {
  "use strict";

  const { add, unpack } = window.nmpcrl;
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
    const { chosen, looks, layouts, decays, seeds } = data;
    const known = { [chosen.layout]: await runsOf(data.given, data) };
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

  window.nmpcrl = { ...window.nmpcrl, published };
})();
