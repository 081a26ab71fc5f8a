// What every live figure shares: elements, how a figure begins, symbols in texts, buttons, and the line of results.
//
// What can be moved is `given`, for example { start, theta, horizon, discs }. A part of a figure takes what it needs,
// calls `move(change)` when the reader moves something, and returns what draws it: (given, found) => {}.
(() => {
  "use strict";

  const { solver, words: { parts: words } } = window.nmpcrl;
  const SVG = "http://www.w3.org/2000/svg";
  const QUIET = 500; // after the last change, before a screen reader speaks [ms]
  const OWN_KEYS = { "data-lm-suppress-shortcuts": true }; // or JupyterLab takes the arrow keys for its own

  const clamp = (number, least, most) => Math.min(Math.max(number, least), most);
  const points = (places) => places.map(([x, y]) => `${x},${y}`).join(" ");

  // A new element of HTML or, within a picture, of SVG.
  function add(parent, name, attributes = {}, text = "") {
    const element = document.createElementNS(name === "svg" ? SVG : parent.namespaceURI, name);
    set(element, attributes);
    element.textContent = text;
    return parent.appendChild(element);
  }

  function set(element, attributes) {
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  }

  // Begins every figure of a name: `build(figure, data, nmpc)` draws it.
  function begin(name, build) {
    const fresh = document.querySelectorAll(`figure.live[data-figure=${name}][hidden]`);
    for (const figure of fresh) start(figure, build);
  }

  const runs = () => Boolean(self.WebAssembly && self.DecompressionStream);

  async function start(figure, build) {
    figure.hidden = false;
    figure.addEventListener("focusin", ({ target }) => set(target, OWN_KEYS));
    figure.querySelector("p").remove();
    const data = JSON.parse(figure.querySelector("script").textContent);
    let nmpc;
    try {
      nmpc = await solver(window.nmpcrl.module, data.problem);
    } catch (error) { // without WebAssembly, or in a page that forbids it
      if (runs() && !(error instanceof WebAssembly.CompileError)) throw error;
      add(figure, "p", {}, words.none);
      return;
    }
    build(figure, data, nmpc);
  }

  // What is given now, and what changes it; `show(given)` follows with the next frame.
  function state(given, show) {
    let due = false;
    const next = () => {
      due = false;
      show(given);
    };
    const move = (change) => {
      given = { ...given, ...change };
      if (!due) requestAnimationFrame(next);
      due = true;
    };
    return { read: () => given, move };
  }

  function heading(figure, { map, title, hint }) {
    set(figure, { "aria-label": map });
    add(figure, "p", { class: "title" }, title);
    add(figure, "p", { class: "hint" }, hint);
  }

  function symbol(parent, name) {
    const [letter, ...subscripts] = words.symbols[name];
    const whole = add(parent, "span", { class: "symbol" }, letter);
    subscripts.reduce((above, text) => add(above, "sub", {}, text), whole);
  }

  // A text in which {c} stands for the symbol of c; braces around anything else are letters.
  function write(parent, text) {
    text.split(/\{(\w+)\}/).forEach((piece, k) => {
      if (k % 2 && Object.hasOwn(words.symbols, piece)) symbol(parent, piece);
      else parent.append(k % 2 ? `{${piece}}` : piece);
    });
  }

  // The same text where no symbol can stand: in a label that is read aloud.
  const plain = (text) => text.replace(/\{(\w+)\}/g, (whole, name) => (
    Object.hasOwn(words.symbols, name) ? words.symbols[name].join(" ") : whole
  ));

  // Lines of texts and numbers in turn. A screen reader is given them once nothing changes any more.
  function results(parent) {
    const all = add(parent, "div", { class: "results", role: "status" });
    let quiet = 0;
    return (lines) => {
      set(all, { "aria-busy": true });
      all.replaceChildren();
      for (const texts of lines) {
        const line = add(all, "p");
        texts.forEach((text, k) => {
          line.append(k && !text.startsWith(";") ? " " : "");
          write(k % 2 ? add(line, "b") : line, text);
        });
      }
      clearTimeout(quiet);
      quiet = setTimeout(() => set(all, { "aria-busy": false }), QUIET);
    };
  }

  function button(parent, text, press) {
    const element = add(parent, "button", { type: "button" }, text);
    element.addEventListener("click", press);
    return element;
  }

  window.nmpcrl = {
    ...window.nmpcrl, add, set, parts: { clamp, points, begin, state, heading, symbol, write, plain, results, button },
  };
})();
