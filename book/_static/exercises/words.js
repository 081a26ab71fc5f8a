/* What the exercises of a page say. */
window.nmpcrl = {
  ...window.nmpcrl,
  exerciseWords: {
    answer: "Your answer",
    formulaOf: (names) => `Your answer, a formula of ${names.join(", ")}`,
    check: "Check",
    reset: "Reset",
    resetAll: "Reset all",
    noNumber: "That cannot be read as a number.",
    noChoice: "Choose one of them.",
    noFormula: (why) => `That cannot be read: ${why}.`,
    power: (large) => `Not right: it is too ${large ? "large" : "small"} by a power of ten.`,
    size: (large) => `Not right: it is too ${large ? "large" : "small"}.`,
    sign: "Not right: look at the sign.",
    wrongFormula: (where, value) => `Not right: for ${where} it gives ${value}.`,
    hint: "The next hint is open above.",
    progress: (solved, all, others) => [
      `${solved} of ${all} exercises that are answered on this page are solved.`,
      others ? `The other ${others === 1 ? "one is" : `${others} are`} answered in the notebook.` : "",
    ].join(" ").trim(),
    kept: "Kept in this browser only.",
    unkept: "This browser keeps nothing: the answers are gone when the page closes.",
  },
};
