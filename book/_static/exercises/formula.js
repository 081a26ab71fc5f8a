/* Formulas that a reader types, in the language of nmpcrl/course/formulas.py: numbers, variables,
   + - * / ^ (or **), brackets and some functions. Text in, a function of the variables out. */
(() => {
  const functions = {
    sqrt: Math.sqrt, exp: Math.exp, log: Math.log, sin: Math.sin, cos: Math.cos,
    abs: Math.abs, max: Math.max, min: Math.min,
  };
  const token = /\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*)|(\*\*|[-+*/^(),]))/y;

  /* What is typed as it is printed, with a keyboard's signs: 2·10⁻⁷ as 2*10^-7. */
  function plain(text) {
    const signs = text.replaceAll("−", "-").replace(/[·×]/g, "*");
    return signs.replace(/[⁻⁰¹²³⁴-⁹]+/g, (power) => `^${[...power].map((one) => "-0123456789"["⁻⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(one)]).join("")}`);
  }

  function tokens(text) {
    const found = [];
    token.lastIndex = 0;
    for (let end = 0; end < text.length; end = token.lastIndex) {
      const [, number, name, sign] = token.exec(text) ?? fail(`"${text.slice(end).trim()}" is unknown`);
      found.push({ number, name, sign: sign === "**" ? "^" : sign });
    }
    return found;
  }

  function fail(why) {
    throw new SyntaxError(why);
  }

  /* The value of `text` for values of its variables, an object by name; throws a SyntaxError. */
  function value(text, variables) {
    const rest = tokens(plain(text).trim());
    const next = (...signs) => signs.includes(rest[0]?.sign) && rest.shift().sign;
    const expect = (sign) => next(sign) || fail(`a "${sign}" is missing`);

    function sum() {
      let total = product();
      for (let sign; (sign = next("+", "-")); ) total = sign === "+" ? total + product() : total - product();
      return total;
    }
    function product() {
      let total = signed();
      for (let sign; (sign = next("*", "/")); ) total = sign === "*" ? total * signed() : total / signed();
      return total;
    }
    function signed() {
      const sign = next("+", "-");
      return sign ? (sign === "-" ? -signed() : signed()) : power();
    }
    function power() {
      const base = atom();
      return next("^") ? base ** signed() : base;
    }
    function atom() {
      if (next("(")) {
        const inner = sum();
        expect(")");
        return inner;
      }
      const { number, name } = rest.shift() ?? fail("something is missing at its end");
      if (number) return Number(number);
      if (name && Object.hasOwn(variables, name)) return variables[name];
      if (name && Object.hasOwn(functions, name)) return called(functions[name]);
      return fail(name ? `${name} is not among its variables` : "something is missing in it");
    }
    function called(f) {
      expect("(");
      const given = [sum()];
      while (next(",")) given.push(sum());
      expect(")");
      return f(...given);
    }

    const total = sum();
    if (rest.length) fail("something is left at its end, and a product needs its *");
    return total;
  }

  window.nmpcrl = { ...window.nmpcrl, formula: { value } };
})();
