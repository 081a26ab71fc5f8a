// Words and numbers that a reader sees or hears in several live figures; those of one alone are in NAME_words.js.
// In results, and where it says so, {c} stands for the symbol of c.
(() => {
  "use strict";

  const POWERS = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"; // digits as exponents

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

  // A power of ten, perhaps with a factor in front.
  function scientific(number) {
    const exponent = Math.floor(Math.log10(number) + 1e-9), factor = fixed(number / 10 ** exponent, 1);
    return (factor === "1.0" ? "" : `${factor} · `) + power(exponent);
  }

  const parts = {
    fixed,
    power,
    sized,
    scientific,
    none: "This browser does not run WebAssembly, or cannot unpack it, so the figure stays as it is printed above.",
    noWorker: "it did not start a worker",
    target: "target",
    robot: "Robot, start",
    heading: "Robot, heading",
    obstacle: (number) => `Obstacle ${number}`,
    tick: (metres, last) => fixed(metres, 0) + (last ? " m" : ""),
    place: (x, y) => `x ${fixed(x, 2)} m, y ${fixed(y, 2)} m`,
    angle: (radians) => `${fixed((radians * 180) / Math.PI, 0)} degrees`,
    symbols: { // letter, its subscript, and the subscript's own
      x: ["θ", "x"], y: ["θ", "y"], heading: ["θ", "φ"], v: ["θ", "v"], nu: ["θ", "ν"],
      x_f: ["θ", "x", "f"], y_f: ["θ", "y", "f"], heading_f: ["θ", "φ", "f"], c: ["θ", "c"], horizon: ["N"],
      alpha: ["α"], beta: ["β"], gamma: ["γ"], epsilon_v: ["ε", "v"], epsilon_nu: ["ε", "ν"], h: ["h"], walk: ["d"],
    },
    sliders: {
      x: "theta x, weight of the distance in x at each planned step",
      y: "theta y, weight of the distance in y at each planned step",
      heading: "theta phi, weight of the heading at each planned step",
      v: "theta v, weight of the speed",
      nu: "theta nu, weight of the turn rate",
      x_f: "theta x f, weight of the distance in x at the end of the plan",
      y_f: "theta y f, weight of the distance in y at the end of the plan",
      heading_f: "theta phi f, weight of the heading at the end of the plan",
      c: "theta c, tightens the obstacle constraint",
    },
  };

  const player = { play: "Play", pause: "Pause", step: "Step", speed: "Speed of play", times: (factor) => `${factor} ×` };

  window.nmpcrl = { ...window.nmpcrl, words: { parts, player } };
})();
