// Long work in slices, so that the page stays responsive: some milliseconds of each frame.
(() => {
  "use strict";

  const SLICE = 24; // of a frame [ms]
  const DRAWN = 200; // from one picture to the next [ms]

  // `work()` does a little and says whether there is more; `pause()` draws now and then, `rest()` at the end.
  function slices({ work, pause, rest }) {
    let frame = 0, drawn = 0;
    const stop = () => {
      if (!frame) return;
      cancelAnimationFrame(frame);
      frame = 0;
      rest();
    };
    const slice = () => {
      const end = performance.now() + SLICE;
      let more = true;
      while (more && performance.now() < end) more = work();
      if (!more) return stop();
      if (performance.now() > drawn + DRAWN) {
        pause();
        drawn = performance.now();
      }
      frame = requestAnimationFrame(slice);
    };
    const begin = () => { frame = requestAnimationFrame(slice); };
    return { begin, stop, running: () => frame !== 0 };
  }

  window.nmpcrl = { ...window.nmpcrl, slices };
})();
