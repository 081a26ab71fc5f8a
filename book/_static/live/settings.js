// The settings of a run: what each may be, the link that restores them, and the same run in Python.
//
// Settings: { learner, alpha, beta, beta_tdc, zeta, decay, decay_rate, horizon, seed, episodes, layout, start,
// target, theta }, under the names of `Experiment`; `layout` holds centres [m], `fields` is report/live/training.py's.
(() => {
  "use strict";

  const POSES = ["start", "target"];
  const TURN = 2 * Math.PI; // a heading, to either side [rad]

  function defaults({ fields, layouts, start, target, theta }) {
    const layout = layouts.A;
    return { ...Object.fromEntries(fields.map((each) => [each.name, each.default])), layout, start, target, theta };
  }

  // The value that a text stands for; undefined if it may not be that.
  function parsed(text, { choices, least, most, whole }) {
    if (choices) return choices.includes(text) ? text : undefined;
    const number = Number(text);
    const fits = text.trim() !== "" && number >= least && number <= most && (!whole || Number.isInteger(number));
    return fits ? number : undefined;
  }

  const rows = (text) => text.split(";").map((row) => row.split(",").map((word) => (word.trim() ? Number(word) : NaN)));

  function within([x, y], [lower, upper]) {
    return x >= lower[0] && x <= upper[0] && y >= lower[1] && y <= upper[1];
  }

  // The layout, a pose or theta of a link; undefined if it is none.
  function place(name, text, { most, view: [left, bottom, width, height], box, theta, limits }) {
    const found = rows(text), [first] = found;
    if (found.flat().some((number) => !Number.isFinite(number))) return undefined;
    if (name === "layout") {
      const map = [[left, bottom], [left + width, bottom + height]];
      return found.length <= most && found.every((row) => row.length === 2 && within(row, map)) ? found : undefined;
    }
    if (name === "theta") {
      return first.length === theta.length && first.every((each) => Math.abs(each) <= limits.absurd) ? first : undefined;
    }
    return first.length === 3 && within(first, box) && Math.abs(first[2]) <= TURN ? first : undefined;
  }

  // What a link's fragment says; { damaged: [name, text] } of what makes no sense, null if it is no link of ours.
  function read(fragment, data) {
    if (!fragment.includes("=")) return null;
    const found = defaults(data);
    for (const part of fragment.replace(/^#/, "").split("&")) {
      const [name, text = ""] = part.split("=").map(decoded), field = data.fields.find((each) => each.name === name);
      const known = field || name === "layout" || name === "theta" || POSES.includes(name);
      const value = known && (field ? parsed(text, field) : place(name, text, data));
      if (value === undefined || !known) return { damaged: [name, text] };
      found[name] = value;
    }
    return found;
  }

  function decoded(text) {
    try {
      return decodeURIComponent(text);
    } catch { // a lone %
      return text;
    }
  }

  // The fragment of a link that restores the settings; theta only where it is not the first.
  function written(given, data) {
    const first = String(given.theta) === String(data.theta);
    const parts = data.fields.map(({ name }) => `${name}=${given[name]}`);
    return [
      ...parts, `layout=${given.layout.join(";")}`, ...POSES.map((name) => `${name}=${given[name]}`),
      ...(first ? [] : [`theta=${given.theta}`]),
    ].join("&");
  }

  // What differs from the defaults and is read by the learner, by name.
  function changed(given, data) {
    const before = defaults(data);
    const read = ({ name, read_by: readBy }) => readBy.includes(given.learner) || name === "learner";
    const names = [...data.fields.filter(read).map(({ name }) => name), "layout", ...POSES, "theta"];
    return names.filter((name) => String(given[name]) !== String(before[name]));
  }

  // A template of report/continuing.py with its places filled.
  const filled = (template, values) => template.replace(/\{(\w+)\}/g, (_, name) => values[name]);

  // The name of a layout that has one.
  const named = ({ layout }, { layouts }) => (
    Object.keys(layouts).find((name) => String(layouts[name]) === String(layout))
  );

  // The same run as a command, and as a few lines of library code.
  function command(given, data) {
    const quoted = (text) => (text.includes(" ") ? `"${text}"` : text);
    const options = changed(given, data).map((name) => {
      const value = name === "layout" ? named(given, data) ?? given.layout.join(" ") : String(given[name]);
      return filled(data.templates.option, { name: name.replaceAll("_", "-"), value: quoted(value) });
    });
    return filled(data.templates.command, { options: options.join("") });
  }

  function code(given, data) {
    const tuple = (each) => (Array.isArray(each) ? `(${each.map(tuple).join(", ")}${each.length === 1 ? "," : ""})` : each);
    const literal = (value) => (typeof value === "string" ? `"${value}"` : tuple(value));
    const fields = changed(given, data)
      .map((name) => [name, (name === "layout" && named(given, data)) || given[name]])
      .map(([name, value]) => filled(data.templates.field, { name, value: literal(value) }));
    return filled(data.templates.code, { fields: fields.join("") + (fields.length ? "\n" : "") });
  }

  window.nmpcrl.settings = { defaults, parsed, read, written, changed, named, command, code };
})();
