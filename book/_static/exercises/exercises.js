/* Answers that are typed on a page: each `div.answer` holds what its check needs, as `nmpcrl.course`
   made it. What was answered stays in this browser under KEY: { name: { answer, solved, misses } }. */
(() => {
  const KEY = "nmpcrl.exercises";
  const { exerciseWords: words, formula } = window.nmpcrl;

  /* Checks: an answer as it was typed, to what is said of it and whether it is right. */

  /* What `read` gives, or null where what was typed cannot be read; `why` is given its sentence. */
  function readable(read, why = () => {}) {
    try {
      return read();
    } catch (error) {
      if (!(error instanceof SyntaxError)) throw error;
      why(error.message);
      return null;
    }
  }

  const near = (value, other, within) => Math.abs(value - other) <= within;

  /* What a number can mean as it was typed: 2,600 is read with either comma, and 20 % is 0.2. */
  function meanings(typed, unit) {
    let text = typed.trim();
    if (unit && text.endsWith(unit)) text = text.slice(0, -unit.length);
    const share = text.endsWith("%");
    if (share) text = text.slice(0, -1);
    const texts = [text.replace(",", "."), text.replace(/,(?=\d{3}(?!\d))/g, "")].filter((one) => !one.includes(","));
    const read = texts.map((one) => formula.value(one, {}));
    if (!read.length) throw new SyntaxError("it has too many commas");
    return share ? read.map((value) => value / 100) : read;
  }

  function number(typed, { expected, within, mistakes, said, unit }) {
    const read = readable(() => meanings(typed, unit));
    if (!read || !read.every(Number.isFinite)) return { said: words.noNumber, unread: true };
    const value = read.find((one) => near(one, expected, within)) ?? read[0];
    if (near(value, expected, within)) return { said, solved: true };
    const share = within / (Math.abs(expected) || 1);
    const known = mistakes.find(([wrong]) => near(value, wrong, share * (Math.abs(wrong) || 1)));
    return { said: known ? known[1] : direction(value, expected) };
  }

  function direction(value, expected) {
    if (value * expected < 0) return words.sign;
    const ten = Math.log10(value / expected);
    if (Math.abs(ten) > 0.5 && near(ten, Math.round(ten), 0.005)) return words.power(ten > 0);
    return words.size(Math.abs(value) > Math.abs(expected));
  }

  function choice(typed, { right, why, said }) {
    if (!typed) return { said: words.noChoice, unread: true };
    return typed === right ? { said, solved: true } : { said: why[typed] };
  }

  function formulaOf(typed, { cases, values, mistakes, said }) {
    let why;
    const given = readable(() => cases.map((one) => formula.value(typed, one)), (message) => { why = message; });
    if (!given) return { said: words.noFormula(why), unread: true };
    const same = (others) => given.every((one, k) => near(one, others[k], 1e-12 + 1e-6 * Math.abs(others[k])));
    if (same(values)) return { said, solved: true };
    const known = mistakes.find(([others]) => same(others));
    const where = Object.entries(cases[0]).map(([name, value]) => `${name} = ${value.toPrecision(4)}`).join(", ");
    return { said: known ? known[1] : words.wrongFormula(where, given[0].toPrecision(4)) };
  }

  const checks = { number, choice, formula: formulaOf };

  /* What is kept. */

  let memory = {};
  let keeps = true;

  function kept() {
    if (!keeps) return memory;
    try {
      const all = Object.entries(JSON.parse(localStorage.getItem(KEY)) ?? {});
      return Object.fromEntries(all.filter(([, state]) => typeof state?.answer === "string"));
    } catch {
      return memory;
    }
  }

  function keep(all) {
    memory = all;
    try {
      localStorage.setItem(KEY, JSON.stringify(all));
    } catch {
      keeps = false;
    }
  }

  function remember(name, state) {
    const all = kept();
    if (state) all[name] = state;
    else delete all[name];
    keep(all);
  }

  /* The page. */

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  function textField(id, label, unit) {
    const input = element("input", { id, type: "text", autocomplete: "off", autocapitalize: "off", spellcheck: "false" });
    if (unit) input.setAttribute("aria-describedby", `${id}-unit`);
    const behind = unit ? [element("span", { id: `${id}-unit`, class: "unit" }, unit)] : [];
    const field = element("p", {}, element("label", { for: id }, label), " ", input, " ", ...behind);
    return { field, read: () => input.value, write: (value) => (input.value = value) };
  }

  function letters(id, names) {
    const inputs = names.map((value) => element("input", { type: "radio", name: id, id: `${id}-${value}`, value }));
    const labels = inputs.map((input) => element("label", { for: input.id }, input, ` ${input.value}`));
    const field = element("fieldset", {}, element("legend", {}, words.answer), ...labels);
    return {
      field,
      read: () => inputs.find((one) => one.checked)?.value ?? "",
      write: (value) => inputs.forEach((one) => (one.checked = one.value === value)),
    };
  }

  function fieldFor(id, data) {
    if (data.kind === "choice") return letters(id, Object.keys(data.why));
    return textField(id, data.kind === "formula" ? words.formulaOf(data.variables) : words.answer, data.unit);
  }

  /* The hints of an exercise are the boxes between it and the place of its answer. */
  function hintsOf(place) {
    const found = [];
    for (let one = place.previousElementSibling; one && !one.matches(".exercise"); one = one.previousElementSibling) {
      if (one.matches("details.folded")) found.unshift(one);
    }
    return found;
  }

  function exercise(place, changed) {
    const data = JSON.parse(place.querySelector("script").textContent);
    const name = place.dataset.exercise;
    place.dataset.kind = data.kind;
    const field = fieldFor(`answer-${name}`, data);
    const said = element("p", { class: "said", role: "status" });
    const again = element("button", { type: "button" }, words.reset);
    const form = element("form", { novalidate: "", "aria-label": `Exercise ${place.dataset.number}` });
    form.append(field.field, element("p", {}, element("button", { type: "submit" }, words.check), " ", again), said);

    function show(sentence, verdict) {
      said.textContent = sentence;
      place.dataset.verdict = verdict;
    }

    function reset() {
      remember(name, null);
      field.write("");
      show("", "");
      changed();
    }

    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const answer = field.read();
      const verdict = checks[data.kind](answer, data);
      if (verdict.unread) { // costs nothing
        show(verdict.said, "");
        return;
      }
      const before = kept()[name];
      const misses = (before?.misses || 0) + (verdict.solved ? 0 : 1);
      const hint = !verdict.solved && hintsOf(place)[misses - 1];
      if (hint) hint.open = true;
      // what was right once stays, whatever is tried after it
      if (verdict.solved || !before?.solved) remember(name, { answer, solved: Boolean(verdict.solved), misses });
      show([verdict.said, hint ? words.hint : ""].join(" ").trim(), verdict.solved ? "right" : "wrong");
      changed();
    });
    again.addEventListener("click", reset);

    const before = kept()[name];
    if (before) {
      field.write(before.answer);
      const verdict = checks[data.kind](before.answer, data);
      show(verdict.said, verdict.solved ? "right" : "wrong");
    }
    place.append(form);
    place.hidden = false;
    return { name, reset };
  }

  function start() {
    const places = [...document.querySelectorAll("div.answer[data-exercise]")];
    if (!places.length) return;
    const count = element("span", { role: "status" });
    const all = element("button", { type: "button" }, words.resetAll);
    const others = Math.max(0, document.querySelectorAll(".exercise").length - places.length);
    const changed = () => {
      const solved = made.filter(({ name }) => kept()[name]?.solved).length;
      count.textContent = `${words.progress(solved, made.length, others)} ${keeps ? words.kept : words.unkept}`;
    };
    const made = [];
    for (const place of places) made.push(exercise(place, changed));
    all.addEventListener("click", () => made.forEach(({ reset }) => reset()));
    const first = places[0].parentElement.querySelector(".exercise") ?? places[0];
    first.before(element("p", { class: "exercise-progress" }, count, " ", all));
    changed();
  }

  document.addEventListener("DOMContentLoaded", start);
})();
