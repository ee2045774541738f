/* Elements, numbers with units, and files that a reader saves. */

/** A new element; attributes that begin with "on" are listeners, and text is text. */
function element(tag, attributes = {}, ...children) {
  const space = ["svg", "path", "line", "text", "g", "rect", "circle"].includes(tag) ? "http://www.w3.org/2000/svg" : null;
  const own = space ? document.createElementNS(space, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) own.addEventListener(name.slice(2), value);
    else if (value === true) own.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) own.setAttribute(name, value);
  }
  own.append(...children.filter((child) => child !== null && child !== undefined));
  return own;
}

const PREFIXES = { "-15": "f", "-12": "p", "-9": "n", "-6": "\u00b5", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };

/** A number with some significant digits, without needless zeros. */
function number(value, digits = 4) {
  if (!Number.isFinite(value)) return "none";
  if (value === 0) return "0";
  const size = Math.abs(value), text = size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  const [mantissa, power] = text.split("e");
  const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
  return (power ? `${short}e${Number(power)}` : short).replace("-", "\u2212").replace("e-", "e\u2212");
}

/** A value with its unit and a prefix: 0.01 s is 10 ms. Only single units take one. */
function quantity(value, unit, digits = 4) {
  if (!/^(m|s|N|J|Pa|W|C|K|T|Hz|m\/s)$/.test(unit) || unit === "K" || value === 0 || !Number.isFinite(value)) {
    return `${number(value, digits)}${unit ? ` ${raised(unit)}` : ""}`;
  }
  const power = Math.max(-15, Math.min(9, 3 * Math.floor(Math.log10(Math.abs(value) * (1 + 1e-12)) / 3)));
  return `${number(value / 10 ** power, digits)} ${PREFIXES[power]}${unit}`;
}

/** Units with raised powers: m^3 is m\u00b3. */
function raised(unit) {
  const digits = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
  return unit.replace(/\^(-?)(\d+)/g, (_, sign, power) => (sign ? "\u207b" : "") + [...power].map((d) => digits[d]).join(""));
}

/** Lets the reader keep content as a file. */
function download(name, content, kind) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type: kind }));
  const link = element("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

/** Rows of cells as text of a table of comma-separated values. */
function csv(rows) {
  const cell = (value) => {
    let text = String(value ?? "");
    // A spreadsheet would compute text that begins like a formula.
    if (typeof value === "string" && /^[=+\-@\t\r]/.test(text)) text = `'${text}`;
    return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  return rows.map((row) => row.map(cell).join(",")).join("\n") + "\n";
}

/** One of many that is chosen, and those who are told of it. */
class Choice {
  constructor() {
    Object.assign(this, { chosen: -1, listeners: [] });
  }

  choose(k) {
    if (k === this.chosen || k < 0) return;
    this.chosen = k;
    for (const listener of this.listeners) listener(k);
  }
}
