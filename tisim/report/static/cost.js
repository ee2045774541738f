/* The page of a study of costs: error against time of all settings, a table, and the chosen setting. */

const DASHES = { "f64 strict": [], "f64 fast": [2, 3] }, OTHER_DASH = [6, 4];

class CostPage {
  constructor(facts) {
    const id = (name) => document.getElementById(name), choice = this.choice = new Choice();
    Object.assign(this, { facts, rows: facts.rows, hidden: new Set(), file: `${facts.name}_cost`.replace(/[^\w.-]+/g, "_") });
    this.methods = [...new Set(this.rows.map((row) => row.method))];
    this.diagrams = facts.quantities.map((one, q) => this.diagram(id("diagrams"), one, q));
    this.legend(id("methods"));
    this.table = new RowTable(id("rows"), this.rows.length, this.columns(),
      { file: this.file, label: "settings", chosen: () => choice.chosen, choose: (k) => choice.choose(k) });
    choice.listeners.push((k) => {
      this.panel(id("chosen"), k);
      this.table.markChosen();
      for (const plot of this.diagrams) plot.markChosen();
      for (const name of ["shown", "told"]) id(name).textContent = this.describe(k, 0);
    });
    if (this.rows.length) choice.choose(Math.max(0, this.rows.findIndex((row) => row.errors[0]?.best)));
  }

  /** Boxes that hide methods, with the colours of their lines. */
  legend(place) {
    place.append(element("legend", {}, "Methods"), ...this.methods.map((method) => {
      const swatch = element("span", { class: `swatch s${this.colour(method)}` });
      return element("label", { class: "check" }, element("input", { type: "checkbox", checked: true, onchange: (event) => {
        this.hidden[event.target.checked ? "delete" : "add"](method);
        for (const plot of this.diagrams) {
          plot.axes();
          plot.repaint();
        }
      } }), swatch, method);
    }));
  }

  /** A method has one colour in all precisions and arithmetics. */
  usual(method) {
    const row = this.rows.find((one) => one.method === method);
    return [row.precision, row.arithmetic].reduce((name, kind) => name.replace(`, ${kind}`, ""), method);
  }

  colour(method) {
    this.usuals ??= [...new Set(this.methods.map((one) => this.usual(one)))];
    return this.usuals.indexOf(this.usual(method)) % STROKES.length;
  }

  diagram(place, quantity, q) {
    const { rows, choice } = this, shown = (row) => row.errors.length > 0 && !row.same && row.time !== null && !this.hidden.has(row.method);
    const parameters = (row) => row.setting.replace(/(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?/g, "");
    const ink = (row, colours) => colours?.[STROKES[this.colour(row.method)]];
    return new Scatter(place, { title: `${quantity.name}, relative to ${quantity.relativeTo}`, file: `${this.file}_${quantity.name}`, height: 440,
      label: `Error of ${quantity.name} against wall time` }, {
      x: rows.map((row) => row.time ?? NaN), y: rows.map((row) => row.errors[q]?.atMost ?? NaN),
      xAxis: { label: "wall time", unit: "s", logarithmic: true }, yAxis: { label: "relative error", logarithmic: true },
      style: (k, colours) => (!shown(rows[k]) ? null : { radius: 4.5, fill: rows[k].errors[q].known ? ink(rows[k], colours) : colours?.panel,
        stroke: rows[k].errors[q].best ? colours?.ink : ink(rows[k], colours), width: rows[k].errors[q].best ? 2.2 : 1.4, bar: ink(rows[k], colours) }),
      order: (k) => (rows[k].errors[q]?.best ? 1 : 0),
      xBar: (k) => (rows[k].repeats > 1 ? [rows[k].least, rows[k].most] : null),
      yBar: (k) => {
        const { error, uncertainty, known } = rows[k].errors[q];
        return known && uncertainty > 0 ? [Math.max(error - uncertainty, 1e-3 * error), error + uncertainty] : null;
      },
      // Only settings of the same parameters are joined.
      paths: (colours) => this.methods.filter((method) => !this.hidden.has(method)).map((method) => {
        const own = [...rows.keys()].filter((k) => rows[k].method === method && shown(rows[k])).sort((a, b) => rows[a].time - rows[b].time), first = rows[own[0]];
        if (!first || new Set(own.map((k) => parameters(rows[k]))).size > 1) return { points: [], stroke: "" };
        return { points: own, stroke: ink(first, colours), dash: DASHES[`${first.precision} ${first.arithmetic}`] ?? OTHER_DASH };
      }),
      bands: (colours) => (quantity.reference > 0 ? [{ low: 0, high: quantity.reference, fill: colours.line, text: "error of the reference" }] : []),
      describe: (k) => this.describe(k, q), chosen: () => choice.chosen, choose: (k) => choice.choose(k),
      columns: () => [["method", rows.map((row) => row.method)], ["setting", rows.map((row) => row.setting)], ["options", rows.map((row) => row.options)]] });
  }

  errorText({ error, atMost, known }) {
    return known ? number(error, 2) : `< ${number(atMost, 1)}`;
  }

  describe(k, q) {
    const row = this.rows[k], best = row.errors[q]?.best;
    const head = `${row.method}, ${row.setting}`;
    if (row.failed) return `${head}: ${row.failed}`;
    return `${head}: ${row.time === null ? "no time" : quantity(row.time, "s", 3)}, error ${row.errors[q] ? this.errorText(row.errors[q]) : "not known"}${row.starts > 1 ? `, ${row.starts} starts` : ""}${best ? `, cheapest for ${best}` : ""}`;
  }

  columns() {
    const { rows, facts } = this, known = (value) => (Number.isFinite(value) ? value : NaN);
    const numbers = (head, value, digits = 4) => ({ head, number: true, value: (k) => known(value(rows[k])), text: (k) => (Number.isFinite(value(rows[k])) ? number(value(rows[k]), digits) : "") });
    const texts = (head, value) => ({ head, number: false, value: (k) => value(rows[k]), text: (k) => value(rows[k]) });
    return [texts("setting", (row) => `${row.method}, ${row.setting}`), numbers("time (s)", (row) => row.time ?? NaN, 3),
      ...facts.quantities.map((one, q) => ({ head: `error of ${one.name}`, number: true, value: (k) => known(rows[k].errors[q]?.atMost), text: (k) => (rows[k].errors[q] ? this.errorText(rows[k].errors[q]) : "") })),
      texts("best for", (row) => (row.same ? "no change" : row.errors[0]?.best ?? "")), numbers("steps", (row) => row.steps ?? NaN), numbers("forces", (row) => row.sums ?? NaN),
      numbers("rejected", (row) => row.rejections ?? NaN), numbers("starts", (row) => row.starts), texts("options of tisim run", (row) => row.options), texts("failed", (row) => row.failed)];
  }

  panel(place, k) {
    const row = this.rows[k], { facts } = this, button = (text, label, step) => element("button", { type: "button", "aria-label": label, onclick: () => this.choice.choose(this.table.next(k, step)) }, text);
    const line = (name, text) => element("tr", {}, element("th", { scope: "row" }, name), element("td", { class: "number" }, text));
    const text = (content, file, title) => {
      const pre = element("pre", { tabindex: 0, "aria-label": title }, content);
      return [element("h3", {}, title), copying(pre, file), pre];
    };
    const errors = row.errors.map((one, q) => line(`error of ${facts.quantities[q].name}`, `${this.errorText(one)}${one.known && one.uncertainty ? ` \u00b1 ${number(one.uncertainty, 1)}` : ""}`));
    const work = [["steps", row.steps], ["force evaluations", row.sums], ["rejected steps", row.rejections]].filter(([, value]) => value !== null).map(([name, value]) => line(name, number(value, 4)));
    const time = row.time === null ? [] : [line("time", row.repeats > 1 ? `${quantity(row.time, "s", 3)} (${quantity(row.least, "s", 3)} to ${quantity(row.most, "s", 3)})` : quantity(row.time, "s", 3))];
    place.replaceChildren(element("h2", {}, row.method), element("p", {}, row.setting),
      element("div", { class: "buttons" }, button("\u2039 before", "Setting before in the table", -1), button("after \u203a", "Setting after in the table", 1)),
      ...(row.failed ? [element("p", { class: "warning failed" }, row.failed)] : []),
      element("table", {}, element("tbody", {}, ...time, ...errors, ...work, line("precision, arithmetic", `${row.precision}, ${row.arithmetic}`), line("random starts", String(row.starts)))),
      ...(row.same ? [element("p", { class: "quiet" }, "The same errors, up to rounding, as with the law that it approximates.")] : []),
      ...text(`tisim run scene.toml ${row.options}`.trim(), `${this.file}_setting.txt`, "Command, with the scene of this page"), ...text(row.python, `${this.file}_setting.py`, "Stepper and changed laws, in Python"));
  }

  theme() {
    for (const plot of this.diagrams) plot.repaint();
  }
}

function startCost() {
  tables();
  report.page = new CostPage(json("facts"));
  themes(() => report.page.theme());
  document.documentElement.dataset.ready = "yes";
}

startCost();
