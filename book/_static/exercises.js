/* Answers that are typed on a page, numbers and letters: each `div.answer` holds what its check needs, as
   `nmpcrl.course` made it. What was answered stays in this browser under KEY: { name: { answer, misses } }. */
(() => {
  const KEY = "nmpcrl.exercises";

  /* Checks: an answer as it was typed, to what is said of it; `solved` where it is right, `unread` where it is none. */

  const near = (value, other, within) => Math.abs(value - other) <= within;

  /* A number as it is typed: with its unit or not, 2,5 as 2.5, 20 % as 0.2, and 2·10⁻⁷ or 2*10^-7 as 2e-7. */
  function read(typed, unit) {
    let text = typed.trim();
    if (unit && text.endsWith(unit)) text = text.slice(0, -unit.length).trim();
    const share = text.endsWith("%");
    text = text.replace("%", "").replace(",", ".").replaceAll("−", "-").replace(/\s/g, "");
    text = text.replace(/[⁻⁰¹²³⁴-⁹]+/, (power) => [...power].map((one) => "-0123456789"["⁻⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(one)]).join(""));
    text = text.replace(/[*·×]10\^?/, "e");
    const value = text ? Number(text) : NaN;
    return share ? value / 100 : value;
  }

  function number(typed, { expected, within, mistakes, said, unit }) {
    const value = read(typed, unit);
    if (!Number.isFinite(value)) return { said: "That cannot be read as a number.", unread: true };
    if (near(value, expected, within)) return { said, solved: true };
    const share = within / (Math.abs(expected) || 1);
    const known = mistakes.find(([wrong]) => near(value, wrong, share * (Math.abs(wrong) || 1)));
    return { said: known ? known[1] : `Not right: ${direction(value, expected)}.` };
  }

  function direction(value, expected) {
    if (value * expected < 0) return "look at the sign";
    const large = Math.abs(value) > Math.abs(expected) ? "large" : "small";
    const ten = Math.log10(value / expected);
    const power = Math.abs(ten) > 0.5 && near(ten, Math.round(ten), 0.005);
    return `it is too ${large}${power ? " by a power of ten" : ""}`;
  }

  function choice(typed, { right, why, said }) {
    if (!typed) return { said: "Choose one of them.", unread: true };
    return typed === right ? { said, solved: true } : { said: why[typed] };
  }

  const checks = { number, choice };

  /* What is kept; a browser that keeps nothing loses it with the page. */

  let memory = {};

  function kept() {
    try {
      const all = JSON.parse(localStorage.getItem(KEY)) ?? memory;
      return Object.fromEntries(Object.entries(all).filter(([, one]) => typeof one?.answer === "string"));
    } catch {
      return memory;
    }
  }

  function remember(name, state) {
    memory = { ...kept(), [name]: state };
    try {
      localStorage.setItem(KEY, JSON.stringify(memory));
    } catch { /* `memory` has it */ }
  }

  /* The page. */

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  function textField(id, unit) {
    const input = element("input", { id, type: "text", autocomplete: "off", autocapitalize: "off", spellcheck: "false" });
    const field = element("p", {}, element("label", { for: id }, "Your answer"), " ", input, ` ${unit}`);
    return { field, read: () => input.value, write: (value) => (input.value = value) };
  }

  function letters(id, names) {
    const inputs = names.map((value) => element("input", { type: "radio", name: id, id: `${id}-${value}`, value }));
    const labels = inputs.map((input) => element("label", { for: input.id }, input, ` ${input.value}`));
    const field = element("fieldset", {}, element("legend", {}, "Your answer"), ...labels);
    return {
      field,
      read: () => inputs.find((one) => one.checked)?.value ?? "",
      write: (value) => inputs.forEach((one) => (one.checked = one.value === value)),
    };
  }

  /* The hints of an exercise are the boxes between it and the place of its answer. */
  function hintsOf(place) {
    const found = [];
    for (let one = place.previousElementSibling; one && !one.matches(".exercise"); one = one.previousElementSibling) {
      if (one.matches("details")) found.unshift(one);
    }
    return found;
  }

  function exercise(place) {
    const data = JSON.parse(place.querySelector("script").textContent);
    const { exercise: name, number: label } = place.dataset;
    const id = `answer-${name}`;
    const field = data.kind === "choice" ? letters(id, Object.keys(data.why)) : textField(id, data.unit);
    const said = element("p", { class: "said", role: "status" });
    const form = element("form", { novalidate: "", "aria-label": `Exercise ${label}` });
    form.append(field.field, element("p", {}, element("button", { type: "submit" }, "Check")), said);

    function judged(answer) {
      const verdict = checks[data.kind](answer, data);
      said.textContent = verdict.said;
      place.dataset.verdict = verdict.unread ? "" : verdict.solved ? "right" : "wrong";
      return verdict;
    }

    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const answer = field.read();
      const verdict = judged(answer);
      if (verdict.unread) return;
      const misses = (kept()[name]?.misses || 0) + (verdict.solved ? 0 : 1);
      const hint = !verdict.solved && hintsOf(place)[misses - 1];
      if (hint) {
        hint.open = true;
        said.textContent += " The next hint is open above.";
      }
      remember(name, { answer, misses });
    });

    const before = kept()[name];
    if (before) {
      field.write(before.answer);
      judged(before.answer);
    }
    place.append(form);
    place.hidden = false;
  }

  document.addEventListener("DOMContentLoaded", () => {
    document.querySelectorAll("div.answer[data-exercise]").forEach(exercise);
  });
})();
