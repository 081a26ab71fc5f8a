// What plays: a slider over steps, and buttons that move it. Nothing moves by itself, and whoever asked for
// reduced motion has no button that would.
(() => {
  "use strict";

  const { add, set, words: { player: words } } = window.nmpcrl;
  const still = matchMedia("(prefers-reduced-motion: reduce)");

  // `read()` is the step now, `write(step)` moves it; `pace` is the time of a step [ms].
  function player(parent, { label, last, pace, text }, { read, write }) {
    const row = add(parent, "div", { class: "stepped player" });
    const button = (name, press) => {
      const made = add(row, "button", { type: "button" }, words[name]);
      made.addEventListener("click", press);
      return made;
    };
    let timer = 0;
    const stop = () => {
      clearInterval(timer);
      timer = 0;
      play.textContent = words.play;
    };
    const next = () => {
      write(Math.min(read() + 1, last));
      if (read() === last) stop();
    };
    const play = button("play", () => {
      if (timer) return stop();
      if (read() === last) write(0);
      timer = setInterval(next, pace);
      play.textContent = words.pause;
    });
    button("step", () => {
      stop();
      next();
    });
    const range = add(row, "input", { type: "range", min: 0, max: last, step: 1, "aria-label": label });
    const value = add(row, "span", { class: "value" });
    range.addEventListener("input", () => {
      stop();
      write(Number(range.value));
    });
    const settle = () => {
      stop();
      play.hidden = still.matches;
    };
    still.addEventListener("change", settle);
    settle();

    const draw = (now) => {
      range.value = now;
      value.textContent = text(now);
      set(range, { "aria-valuetext": value.textContent });
    };
    return { draw, stop };
  }

  window.nmpcrl = { ...window.nmpcrl, player };
})();
