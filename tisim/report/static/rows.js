/* A table of thousands of rows: sorted by any column, one page of it in the document at a time. */

const PAGE_ROWS = 25;

class RowTable {
  /** columns : head, number (whether its cells are), value(k) for sorting and files, text(k) for cells.
      options : file, label, chosen() : row or -1, choose(k), by : column of the order at first. */
  constructor(place, count, columns, options) {
    Object.assign(this, { count, columns, options, page: 0, by: options.by ?? 0, falling: false });
    this.shown = null;
    this.head = element("tr", {}, ...columns.map((one, k) => element("th", { scope: "col", class: one.number ? "number" : null },
      element("button", { type: "button", class: "sort", onclick: () => this.sort(k) }, one.head))));
    this.body = element("tbody");
    this.told = element("span", { role: "status", class: "quiet" });
    const button = (text, label, press) => element("button", { type: "button", "aria-label": label, onclick: press }, text);
    this.before = button("\u2039", "Rows before these", () => this.turn(-1));
    this.after = button("\u203a", "Rows after these", () => this.turn(1));
    this.table = element("table", { class: "rows", "aria-label": options.label }, element("thead", {}, this.head), this.body);
    place.append(element("div", { class: "group pager" }, this.before, this.after, this.told, element("span", { class: "spring" }),
      button("CSV", `Save ${options.label} as CSV`, () => download(`${options.file}.csv`, csv(this.rows()), "text/csv"))),
    element("div", { class: "wide" }, this.table));
    this.body.addEventListener("click", (event) => {
      const row = event.target.closest("tr");
      if (row) this.options.choose(Number(row.dataset.row));
    });
    this.body.addEventListener("keydown", (event) => this.key(event));
    this.order();
  }

  /** rows : of a filter; null for all. */
  filter(rows) {
    this.shown = rows;
    this.page = 0;
    this.order();
  }

  sort(k) {
    this.falling = this.by === k && !this.falling;
    this.by = k;
    this.page = 0;
    this.order();
  }

  order() {
    const { value, number: numeric } = this.columns[this.by], sign = this.falling ? -1 : 1;
    const known = (x) => (numeric ? Number.isFinite(x) : x !== "");
    this.sorted = [...(this.shown ?? Array(this.count).keys())].map((k) => [k, value(k)]).sort(([a, x], [b, y]) => {
      // Rows without a value stay at the end.
      if (known(x) !== known(y)) return known(x) ? -1 : 1;
      return (sign * (numeric ? x - y || 0 : String(x).localeCompare(String(y)))) || a - b;
    }).map(([k]) => k);
    [...this.head.children].forEach((cell, k) => cell.setAttribute("aria-sort", k !== this.by ? "none" : this.falling ? "descending" : "ascending"));
    this.fill();
  }

  turn(step) {
    this.page = Math.max(0, Math.min(Math.ceil(this.sorted.length / PAGE_ROWS) - 1, this.page + step));
    this.fill();
  }

  fill() {
    const first = this.page * PAGE_ROWS, rows = this.sorted.slice(first, first + PAGE_ROWS), chosen = this.options.chosen();
    this.body.replaceChildren(...rows.map((k) => element("tr", { "data-row": k, class: k === chosen ? "chosen" : null, "aria-current": k === chosen ? "true" : null },
      ...this.columns.map((one, c) => {
        const text = one.text(k);
        return c ? element("td", { class: one.number ? "number" : null }, text)
          : element("th", { scope: "row" }, element("button", { type: "button", class: "link", "aria-label": `${one.head} ${text}` }, text));
      }))));
    const last = first + rows.length, all = this.sorted.length;
    this.told.textContent = all ? `${first + 1} to ${last} of ${all}${this.shown && all < this.count ? ` (of all ${this.count})` : ""}` : "none";
    this.before.disabled = this.page === 0;
    this.after.disabled = last >= all;
  }

  /** Marks the chosen row, on its page. */
  markChosen() {
    const at = this.sorted.indexOf(this.options.chosen());
    if (at >= 0 && Math.floor(at / PAGE_ROWS) !== this.page) {
      this.page = Math.floor(at / PAGE_ROWS);
      return this.fill();
    }
    for (const row of this.body.children) {
      const own = Number(row.dataset.row) === this.options.chosen();
      row.classList.toggle("chosen", own);
      if (own) row.setAttribute("aria-current", "true"); else row.removeAttribute("aria-current");
    }
  }

  /** The row after or before another in the order of the table. */
  next(k, step) {
    const at = this.sorted.indexOf(k);
    return this.sorted[at < 0 ? 0 : Math.max(0, Math.min(this.sorted.length - 1, at + step))];
  }

  key(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key], row = event.target.closest("tr");
    if (!step || !row) return;
    const k = this.next(Number(row.dataset.row), step);
    this.options.choose(k);
    this.body.querySelector(`tr[data-row="${k}"] button`)?.focus();
    event.preventDefault();
  }

  rows() {
    return [this.columns.map((one) => one.head), ...this.sorted.map((k) => this.columns.map((one) => one.value(k)))];
  }
}
