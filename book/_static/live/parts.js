// What every live figure shares: numbers, elements, how a figure begins, what can be moved, and the line of results.
//
// What can be moved is `given`, for example { start, theta, horizon, discs }. A part of a figure takes what it needs,
// calls `move(change)` when the reader moves something, and returns what draws it: (given, found) => {}.
(() => {
  "use strict";

  const SVG = "http://www.w3.org/2000/svg";
  const QUIET = 500; // after the last change, before a screen reader speaks [ms]
  const OWN_KEYS = { "data-lm-suppress-shortcuts": true }; // or JupyterLab takes the arrow keys for its own
  const POWERS = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"; // digits as exponents
  const SYMBOLS = { // letter, its subscript, and the subscript's own
    x: ["θ", "x"], y: ["θ", "y"], heading: ["θ", "φ"], v: ["θ", "v"], nu: ["θ", "ν"],
    x_f: ["θ", "x", "f"], y_f: ["θ", "y", "f"], heading_f: ["θ", "φ", "f"], c: ["θ", "c"], horizon: ["N"],
    alpha: ["α"], beta: ["β"], gamma: ["γ"], h: ["h"], walk: ["d"],
  };
  const WEIGHTS = { // as they are read aloud
    x: "theta x, weight of the distance in x at each planned step",
    y: "theta y, weight of the distance in y at each planned step",
    heading: "theta phi, weight of the heading at each planned step",
    v: "theta v, weight of the speed",
    nu: "theta nu, weight of the turn rate",
    x_f: "theta x f, weight of the distance in x at the end of the plan",
    y_f: "theta y f, weight of the distance in y at the end of the plan",
    heading_f: "theta phi f, weight of the heading at the end of the plan",
    c: "theta c, tightens the obstacle constraint",
  };

  const clamp = (number, least, most) => Math.min(Math.max(number, least), most);
  const points = (places) => places.map(([x, y]) => `${x},${y}`).join(" ");

  // A number with so many digits, with a minus sign that is one; none before a zero.
  const fixed = (number, digits) => number.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "\u2212");
  const power = (exponent) => `10${`${exponent}`.replace("-", "\u207b").replace(/\d/g, (digit) => POWERS[digit])}`;

  // A number of any size, with three digits.
  function sized(number) {
    const size = Math.abs(number);
    if (!Number.isFinite(number)) return "out of range";
    if (size === 0 || (size >= 0.01 && size < 10000)) return fixed(number, size >= 100 ? 1 : 3);
    const [digits, exponent] = number.toExponential(2).split("e");
    return `${digits.replace("-", "\u2212")}\u00a0\u00b7\u00a0${power(Number(exponent))}`;
  }

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
    for (const figure of document.querySelectorAll(`figure.live[data-figure=${name}][hidden]`)) start(figure, build);
  }

  async function start(figure, build) {
    figure.hidden = false;
    figure.addEventListener("focusin", ({ target }) => set(target, OWN_KEYS));
    figure.querySelector("p").remove();
    const data = JSON.parse(figure.querySelector("script").textContent);
    let nmpc;
    try {
      nmpc = await window.nmpcrl.solver(window.nmpcrl.module, data.problem);
    } catch (error) { // without WebAssembly, or in a page that forbids it
      if (self.WebAssembly && self.DecompressionStream && !(error instanceof WebAssembly.CompileError)) throw error;
      add(figure, "p", {}, "This browser does not run WebAssembly, or cannot unpack it, so the picture stands alone.");
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

  function heading(figure, { label, title, hint }) {
    set(figure, { "aria-label": label });
    add(figure, "p", { class: "title" }, title);
    if (hint) write(add(figure, "p", { class: "hint" }), hint);
  }

  function symbol(parent, name) {
    const [letter, ...subscripts] = SYMBOLS[name], whole = add(parent, "span", { class: "symbol" }, letter);
    subscripts.reduce((above, text) => add(above, "sub", {}, text), whole);
  }

  // A text in which {c} stands for the symbol of c; braces around anything else are letters.
  function write(parent, text) {
    text.split(/\{(\w+)\}/).forEach((piece, k) => {
      if (k % 2 && Object.hasOwn(SYMBOLS, piece)) symbol(parent, piece);
      else parent.append(k % 2 ? `{${piece}}` : piece);
    });
    return parent;
  }

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

  window.nmpcrl = {
    ...window.nmpcrl, add, set, numbers: { clamp, points, fixed, power, sized },
    parts: { begin, state, heading, symbol, write, results, SYMBOLS, WEIGHTS },
  };
})();
