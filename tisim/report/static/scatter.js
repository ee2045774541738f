/* Points in two axes: error bars, a chosen point, reading by pointer and by keys. */

const REACH = 14, EDGES = { left: 64, right: 14, top: 14, bottom: 44 };

class Scatter extends Plot {
  /** model :
      x, y : values of the points; xAxis, yAxis : facts of the axes.
      style(k, colours) : radius, fill, stroke, width, alpha of a point, or null if it is not shown; higher
        order(k) is drawn later.
      xBar(k), yBar(k) : ends of an interval, or null. paths : rows of points joined by a line, each with
        points, stroke and dash. bands(colours) : low and high y, fill and text of shaded parts.
      describe(k) : text; chosen() : index or -1; choose(k). columns() : head and values of further columns. */
  constructor(place, options, model) {
    super(place, { height: 340, ...options, label: `${options.label ?? options.title}. Arrow keys go from point to point, Enter chooses one.` });
    this.model = { xBar: () => null, yBar: () => null, paths: () => [], bands: () => [], columns: () => [], order: () => 0, ...model };
    this.over = -1;
    this.readout.setAttribute("aria-live", "off");
    this.above.addEventListener("pointermove", (event) => this.hover(this.nearest(event.offsetX, event.offsetY)));
    this.above.addEventListener("pointerleave", () => this.hover(-1));
    this.above.addEventListener("click", (event) => {
      const k = this.nearest(event.offsetX, event.offsetY);
      if (k >= 0) this.model.choose(k);
    });
    this.above.addEventListener("keydown", (event) => this.key(event));
    this.above.addEventListener("focus", () => { if (this.over < 0) this.hover(this.model.chosen()); });
    this.above.addEventListener("blur", () => this.hover(-1));
    this.axes();
    this.resize();
  }

  /** New axes, after the values have changed. */
  axes() {
    const { x, y, xAxis, yAxis } = this.model, drawn = (values) => [...values].filter((_, k) => this.shows(k));
    this.across = new Axis(xAxis, drawn(x));
    this.up = new Axis(yAxis, drawn(y));
    this.sorted = null;
  }

  shows(k) {
    return this.model.style(k, null) !== null;
  }

  arrange() {
    const compact = this.options.compact, edges = compact ? { left: 48, right: 8, top: 8, bottom: 36 } : EDGES;
    this.edges = edges;
    this.px = (value) => edges.left + this.across.place(value) * (this.wide - edges.left - edges.right);
    this.py = (value) => this.high - edges.bottom - this.up.place(value) * (this.high - edges.top - edges.bottom);
  }

  /** The place of a point in the figure, or null. */
  at(k) {
    const { x, y } = this.model;
    if (!this.across.known(x[k]) || !this.up.known(y[k])) return null;
    return [this.px(x[k] + (this.model.shift?.(k)[0] ?? 0)), this.py(y[k] + (this.model.shift?.(k)[1] ?? 0))];
  }

  draw(pen, colours) {
    const { edges, wide, high } = this, bottom = high - edges.bottom, right = wide - edges.right;
    for (const { low, high: upper, fill, text } of this.model.bands(colours)) {
      const top = Math.max(edges.top, this.py(upper)), end = Math.min(bottom, this.py(low));
      if (end <= top) continue;
      pen.rect(edges.left, top, right - edges.left, end - top, { fill });
      pen.text(right - 6, top + 14, text, { fill: colours.quiet, anchor: "end" });
    }
    const across = this.across.ticks(Math.max(3, Math.floor(wide / 100))), up = this.up.ticks(Math.max(3, Math.floor(high / 60)));
    for (const [value, text] of across.ticks) {
      if (this.across.place(value) < 0 || this.across.place(value) > 1) continue;
      pen.line([[this.px(value), edges.top], [this.px(value), bottom]], { stroke: colours.line });
      pen.text(this.px(value), bottom + 16, text, { fill: colours.quiet, anchor: "middle" });
    }
    for (const [value, text] of up.ticks) {
      if (this.up.place(value) < 0 || this.up.place(value) > 1) continue;
      pen.line([[edges.left, this.py(value)], [right, this.py(value)]], { stroke: colours.line });
      pen.text(edges.left - 6, this.py(value) + 4, text.length > 9 ? `${text.slice(0, 8)}\u2026` : text, { fill: colours.quiet, anchor: "end" });
    }
    pen.text((edges.left + right) / 2, high - 6, across.label, { fill: colours.quiet, anchor: "middle" });
    pen.text(13, (edges.top + bottom) / 2, up.label, { fill: colours.quiet, anchor: "middle", turn: -90 });
    for (const { points, stroke, dash = [], width = 1.4 } of this.model.paths(colours)) {
      const places = points.map((k) => this.at(k)).filter(Boolean);
      if (places.length > 1) pen.line(places, { stroke, width, dash });
    }
    const order = [...this.model.x.keys()].filter((k) => this.shows(k)).sort((a, b) => this.model.order(a) - this.model.order(b));
    for (const k of order) this.mark(pen, k, this.model.style(k, colours));
  }

  mark(pen, k, style) {
    const place = this.at(k);
    if (!place) return;
    const [x, y] = place, bar = { stroke: style.bar ?? style.stroke ?? style.fill, width: 1, alpha: 0.8 * (style.alpha ?? 1) };
    const xBar = this.model.xBar(k), yBar = this.model.yBar(k);
    if (xBar) pen.line([[this.px(xBar[0]), y], [this.px(xBar[1]), y]], bar);
    if (yBar) pen.line([[x, this.py(yBar[0])], [x, this.py(yBar[1])]], bar);
    pen.circle(x, y, style.radius, style);
  }

  drawAbove(pen, colours) {
    const chosen = this.model.chosen();
    for (const [k, stroke, radius] of [[chosen, colours.bad, 8], [this.over, colours.ink, 7]]) {
      const place = k >= 0 && this.shows(k) ? this.at(k) : null;
      if (!place) continue;
      this.mark(pen, k, this.model.style(k, colours));
      pen.circle(...place, radius, { stroke, width: k === chosen && k !== this.over ? 2.4 : 1.6 });
    }
  }

  /** The point nearest to a place in the figure; -1 if none is near. */
  nearest(x, y) {
    let best = -1, least = REACH ** 2;
    for (let k = 0; k < this.model.x.length; k++) {
      if (!this.shows(k)) continue;
      const place = this.at(k);
      if (!place) continue;
      const distance = (place[0] - x) ** 2 + (place[1] - y) ** 2;
      if (distance <= least) [best, least] = [k, distance];
    }
    return best;
  }

  hover(k) {
    if (k === this.over) return;
    this.over = k;
    this.above.style.cursor = k >= 0 ? "pointer" : "";
    this.read();
    this.point();
  }

  read() {
    const k = this.over >= 0 ? this.over : this.model.chosen();
    const { x, y, describe } = this.model, shown = k >= 0 && this.shows(k);
    this.readout.textContent = !shown ? "" : this.options.compact ? `${this.across.text(x[k])}, ${this.up.text(y[k])}` : describe(k);
  }

  /** After another point has been chosen elsewhere. */
  markChosen() {
    this.read();
    this.point();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    this.sorted ??= [...this.model.x.keys()].filter((k) => this.shows(k) && this.at(k)).sort((a, b) => this.model.x[a] - this.model.x[b] || this.model.y[a] - this.model.y[b]);
    const last = this.sorted.length - 1, now = this.sorted.indexOf(this.over);
    if (step && last >= 0) this.hover(this.sorted[Math.max(0, Math.min(last, now < 0 ? 0 : now + step))]);
    else if (event.key === "Home" && last >= 0) this.hover(this.sorted[0]);
    else if (event.key === "End" && last >= 0) this.hover(this.sorted[last]);
    else if ((event.key === "Enter" || event.key === " ") && this.over >= 0) this.model.choose(this.over);
    else return;
    this.readout.setAttribute("aria-live", "polite");
    event.preventDefault();
  }

  rows() {
    const { x, y } = this.model, name = ({ label, unit }) => (unit ? `${label} (${unit})` : label), further = this.model.columns();
    const cell = (axis, value) => axis.categories?.[value] ?? value, shown = [...x.keys()].filter((k) => this.shows(k));
    return [[name(this.across), name(this.up), ...further.map(([head]) => head)],
      ...shown.map((k) => [cell(this.across, x[k]), cell(this.up, y[k]), ...further.map(([, values]) => values[k])])];
  }
}
