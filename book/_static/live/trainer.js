// A run in a worker, so that the page stays at hand: the text of the scripts that solve, draw and learn.
(() => {
  "use strict";

  const { sources, words: { parts: words } } = window.nmpcrl;

  // Runs in the worker, which is given { module, problem, settings, widths }.
  function work() {
    async function run({ module, problem, settings, widths }) {
      const nmpc = await self.nmpcrl.solver(module, problem);
      const count = settings.episodes * settings.steps * problem.lower.length;
      const noise = self.nmpcrl.normal(settings.seed, count, widths);
      for (const row of self.nmpcrl.run(nmpc, settings, noise)) self.postMessage({ row });
    }
    self.onmessage = ({ data }) => run(data)
      .then(() => self.postMessage({ end: "" }), (error) => self.postMessage({ end: String(error) }));
  }

  // `on.row` is called after each episode, `on.end` once with an error's sentence or "". What comes back stops it.
  function trainer(given, on) {
    const text = [...sources, work].map((script) => `(${script})();`).join("\n");
    const place = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    const worker = new Worker(place);
    URL.revokeObjectURL(place);
    const end = (why) => {
      worker.terminate();
      on.end(why);
    };
    worker.onmessage = ({ data }) => (data.row ? on.row(data.row) : end(data.end));
    worker.onerror = ({ message }) => end(message || words.noWorker); // it does not even begin
    worker.postMessage(given);
    return () => worker.terminate();
  }

  window.nmpcrl = { ...window.nmpcrl, trainer };
})();
