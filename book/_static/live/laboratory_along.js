// What a reader of the laboratory takes along: the run as a link and as Python.
(() => {
  "use strict";

  const { add, set, settings, parts: shared, words: { laboratory: words } } = window.nmpcrl;

  // Copies a text, and says whether this page may.
  async function copy(text) {
    return Boolean(navigator.clipboard) && navigator.clipboard.writeText(text).then(() => true, () => false);
  }

  // Text to take along, with a button that copies it.
  function copied(parent, { name, label, rows, tell }) {
    const box = add(parent, "textarea", { readonly: "", "aria-label": label, spellcheck: false, rows });
    const button = shared.button(parent, name, async () => {
      box.select();
      const said = await copy(box.value) ? words.copied : words.notCopied;
      tell([[said]]);
      beside.textContent = said;
    });
    const beside = add(parent, "span", { class: "hint", "aria-hidden": true });
    button.addEventListener("blur", () => { beside.textContent = ""; });
    return (text) => {
      if (box.value !== text) box.value = text;
      set(box, { rows: rows ?? text.split("\n").length });
    };
  }

  function takeAlong(parent, data, tell) {
    const link = add(parent, "div", { class: "along" });
    add(link, "p", { class: "plot-title" }, words.link);
    const address = copied(link, { name: words.copyLink, label: words.link, rows: 2, tell });
    const python = add(parent, "div", { class: "along" });
    add(python, "p", { class: "plot-title" }, words.python);
    const same = add(python, "p", { class: "hint" });
    const command = copied(python, { name: words.copyCommand, label: words.commandLabel, tell });
    const code = copied(python, { name: words.copyCode, label: words.codeLabel, tell });
    return (given) => {
      same.textContent = words.pythonHint(given);
      address(`${location.href.split("#")[0]}#${settings.written(given, data)}`);
      command(settings.command(given, data));
      code(settings.code(given, data).trimEnd());
    };
  }

  window.nmpcrl = { ...window.nmpcrl, takeAlong };
})();
