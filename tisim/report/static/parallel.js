/* Parallel coordinates: an axis for each quantity, a line for each design; parts of axes are chosen by drawing. */

const LEAST_SPACING = 58;         // of axes; a narrow page scrolls
const TOP = 42, BOTTOM = 26, GRAB = 18, FAINT = 0.1;
const ROUGH_LINES = 400;        // lines that are drawn while a part is being chosen

class Parallel extends Plot {
  /** axes : for each quantity the facts of its axis and values, number (its column). model :
      colour(k) : CSS; order(k) : higher is drawn later; chosen(); choose(k); describe(k);
      included(k) : whether a line is within all chosen parts; brushed() : called when these have changed. */
  constructor(place, options, axes, model) {
    super(place, { height: 380, least: LEAST_SPACING * axes.length, ...options, label: `${options.title}. The parts of the axes are also fields below.` });
    this.model = model;
    this.over = -1;
    this.axes = axes.map(({ facts, values }) => ({ axis: new Axis(facts, values), values, brush: null }));
    this.order = null;
    this.above.tabIndex = -1;
    this.above.setAttribute("role", "img");
    this.above.addEventListener("pointerdown", (event) => this.down(event));
    this.above.addEventListener("pointermove", (event) => this.move(event));
    this.above.addEventListener("pointerup", (event) => this.up(event));
    this.above.addEventListener("pointercancel", () => { this.drag = null; });
    this.above.addEventListener("pointerleave", () => this.hover(-1));
    this.above.addEventListener("dblclick", (event) => {
      const at = this.axisAt(event.offsetX);
      if (at >= 0) this.brush(at, null);
    });
    this.fields(place);
    this.resize();
  }

  /** Fields with the ends of the chosen parts, for keyboards and for exact numbers. */
  fields(place) {
    const field = (one, at, end, name) => element("input", { type: "text", inputmode: "decimal", size: 8, "aria-label": `${one.axis.label}, ${name}`,
      onchange: (event) => this.typed(at, end, event.target.value) });
    const rows = this.axes.map((one, at) => {
      if (one.axis.categories) {
        const boxes = one.axis.categories.map((text, k) => element("label", { class: "check" }, element("input", { type: "checkbox", checked: true,
          onchange: () => this.brush(at, boxes.every((box) => box.firstChild.checked) ? null : boxes.map((box, m) => (box.firstChild.checked ? m : -1)).filter((m) => m >= 0)) }), text));
        one.boxes = boxes;
        return element("fieldset", { class: "range" }, element("legend", {}, one.axis.label), ...boxes);
      }
      one.inputs = [field(one, at, 0, "at least"), field(one, at, 1, "at most")];
      const name = one.axis.unit ? `${one.axis.label} (${raised(one.axis.unit)})` : one.axis.label;
      return element("fieldset", { class: "range" }, element("legend", {}, name), one.inputs[0], element("span", {}, "to"), one.inputs[1]);
    });
    this.told = element("span", { role: "status", class: "quiet" });
    place.append(element("details", { class: "settings brushes" }, element("summary", {}, "Parts of the axes"), element("div", { class: "group" }, ...rows)),
      element("div", { class: "group" }, element("button", { type: "button", onclick: () => this.clear() }, "All designs"), this.told));
  }

  typed(at, end, text) {
    const { axis, brush } = this.axes[at], value = Number(text.replaceAll("\u2212", "-")), ends = [...(brush ?? axis.ends)];
    ends[end] = text.trim() === "" || !Number.isFinite(value) ? axis.ends[end] : value;
    const whole = ends.every((value, k) => (k ? value >= axis.ends[1] : value <= axis.ends[0]));
    this.brush(at, whole || !(ends[0] <= ends[1]) ? null : ends);
  }

  /** Chooses a part of an axis: its ends, or the categories; null for all. */
  brush(at, part) {
    const one = this.axes[at];
    one.brush = part;
    // A part of the lines is drawn until the choice rests for a moment.
    this.rough = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { this.rough = false; this.repaint(); }, 150);
    if (one.inputs) one.inputs.forEach((input, end) => { input.value = part ? number(part[end], 4) : ""; });
    else one.boxes.forEach((box, k) => { box.firstChild.checked = !part || part.includes(k); });
    this.model.brushed();
  }

  clear() {
    for (const [at, one] of this.axes.entries()) if (one.brush) this.brush(at, null);
  }

  /** Whether a design is within the chosen parts of all axes. */
  within(k) {
    return this.axes.every(({ axis, brush, values }) => {
      if (!brush) return true;
      return axis.categories ? brush.includes(values[k]) : axis.known(values[k]) && values[k] >= brush[0] && values[k] <= brush[1];
    });
  }

  arrange() {
    const n = this.axes.length, side = Math.min(60, 0.5 * this.wide / n);
    this.spacing = n > 1 ? (this.wide - 2 * side) / (n - 1) : this.wide;
    this.x = this.axes.map((_, at) => (n > 1 ? side + at * this.spacing : this.wide / 2));
  }

  y(axis, value) {
    return this.high - BOTTOM - axis.place(value) * (this.high - TOP - BOTTOM);
  }

  places(k) {
    return this.axes.map(({ axis, values }, at) => (axis.known(values[k]) ? [this.x[at], this.y(axis, values[k])] : null)).filter(Boolean);
  }

  draw(pen, colours) {
    this.order ??= [...this.axes[0].values.keys()].sort((a, b) => this.model.order(a) - this.model.order(b));
    this.drawOthers(pen, colours);
    const some = this.order.filter((k) => this.model.included(k)), alpha = Math.max(0.25, Math.min(0.9, 150 / some.length));
    const step = this.rough ? Math.ceil(some.length / ROUGH_LINES) : 1;
    for (const k of some.filter((_, m) => m % step === 0)) pen.line(this.places(k), { stroke: this.model.colour(k), width: 1.2, alpha });
    this.axes.forEach(({ axis, brush }, at) => {
      const x = this.x[at], { label, ticks } = axis.ticks(5), end = at === 0 ? "start" : at === this.axes.length - 1 ? "end" : "middle";
      pen.line([[x, TOP], [x, this.high - BOTTOM]], { stroke: colours.ink, width: 1.2 });
      // Long names would run into each other: every second one stands lower, and ends early.
      const letters = Math.floor((end === "middle" ? 1.9 : 1.4) * this.spacing / 7.2), name = label.length > letters ? `${label.slice(0, letters - 1)}\u2026` : label;
      pen.text(at === 0 ? 4 : end === "end" ? this.wide - 4 : x, at % 2 ? 30 : 14, name, { fill: colours.ink, anchor: end, bold: true });
      for (const [value, text] of ticks) {
        const place = axis.place(value);
        if (place < -1e-9 || place > 1 + 1e-9) continue;
        const y = this.y(axis, value);
        pen.line([[x - 3, y], [x + 3, y]], { stroke: colours.ink });
        pen.rect(x + 4, y - 8, 6.6 * text.length + 2, 14, { fill: colours.panel, alpha: 0.7 });
        pen.text(x + 5, y + 4, text, { fill: colours.ink, size: 11 });
      }
      const parts = !brush ? [] : axis.categories ? brush.map((k) => [k - 0.45, k + 0.45]) : [brush];
      for (const [low, high] of parts) {
        const [top, bottom] = [high, low].map((value) => Math.max(TOP, Math.min(this.high - BOTTOM, this.y(axis, value))));
        pen.rect(x - 7, top, 14, Math.max(bottom - top, 1), { fill: colours.accent, stroke: colours.accent, alpha: 0.35 });
      }
    });
  }

  /** Draws the designs outside the chosen parts: all designs as one faint picture, which is drawn once. */
  drawOthers(pen, colours) {
    if (this.axes.every(({ brush }) => !brush)) return;
    const style = { stroke: colours.quiet, alpha: FAINT };
    if (pen instanceof SvgPen) {
      for (const k of this.order) if (!this.model.included(k)) pen.line(this.places(k), style);
      return;
    }
    const key = `${this.wide} ${colours.quiet}`;
    if (this.faint?.key !== key) {
      const canvas = element("canvas", { width: this.canvas.width, height: this.canvas.height });
      const faint = this.pen(canvas);
      for (const k of this.order) faint.line(this.places(k), style);
      this.faint = { key, canvas };
    }
    pen.context.globalAlpha = 1;
    pen.context.drawImage(this.faint.canvas, 0, 0, this.wide, this.high);
  }

  drawAbove(pen, colours) {
    for (const [k, stroke] of [[this.over, colours.ink], [this.model.chosen(), colours.bad]]) {
      if (k < 0) continue;
      const places = this.places(k);
      pen.line(places, { stroke, width: 2.6 });
      for (const [x, y] of places) pen.circle(x, y, 3.2, { fill: stroke });
    }
  }

  axisAt(x) {
    return this.x.findIndex((place) => Math.abs(place - x) < GRAB);
  }

  /** The line nearest to a place, of those that are included; -1 if none is near. */
  nearest(x, y) {
    const right = this.x.findIndex((place) => place > x), b = right < 0 ? this.x.length - 1 : Math.max(right, 1), a = b - 1;
    if (a < 0) return -1;
    const [one, other] = [this.axes[a], this.axes[b]], part = (x - this.x[a]) / (this.x[b] - this.x[a]);
    let best = -1, least = 8;
    for (let k = 0; k < one.values.length; k++) {
      if (!this.model.included(k) || !one.axis.known(one.values[k]) || !other.axis.known(other.values[k])) continue;
      const place = (1 - part) * this.y(one.axis, one.values[k]) + part * this.y(other.axis, other.values[k]), distance = Math.abs(place - y);
      if (distance < least) [best, least] = [k, distance];
    }
    return best;
  }

  down(event) {
    const at = this.axisAt(event.offsetX);
    this.drag = { at, from: event.offsetY, moved: false };
    if (at >= 0) this.above.setPointerCapture(event.pointerId);
  }

  move(event) {
    const { drag } = this;
    if (!drag || drag.at < 0) {
      this.above.style.cursor = this.axisAt(event.offsetX) >= 0 ? "ns-resize" : "";
      return this.hover(this.nearest(event.offsetX, event.offsetY));
    }
    if (!drag.moved && Math.abs(event.offsetY - drag.from) < 4) return;
    drag.moved = true;
    const { axis } = this.axes[drag.at], inside = (y) => axis.value((this.high - BOTTOM - Math.max(TOP, Math.min(this.high - BOTTOM, y))) / (this.high - TOP - BOTTOM));
    const ends = [inside(drag.from), inside(event.offsetY)].sort((a, b) => a - b);
    if (!axis.categories) return this.brush(drag.at, ends);
    const inPart = axis.categories.map((_, k) => k).filter((k) => k >= ends[0] - 0.5 && k <= ends[1] + 0.5);
    this.brush(drag.at, inPart.length === axis.categories.length ? null : inPart);
  }

  up(event) {
    const { drag } = this;
    this.drag = null;
    if (!drag || drag.moved) return;
    const k = this.nearest(event.offsetX, event.offsetY);
    if (k >= 0) this.model.choose(k);
    else if (drag.at >= 0) this.brush(drag.at, null);
  }

  hover(k) {
    if (k === this.over) return;
    this.over = k;
    this.markChosen();
  }

  markChosen() {
    const k = this.over >= 0 ? this.over : this.model.chosen();
    this.readout.textContent = k >= 0 ? this.model.describe(k) : "";
    this.point();
  }

  tell(number, all) {
    this.told.textContent = number === all ? `${all} designs` : `${number} of ${all} designs within the chosen parts`;
  }

  whole(pen) {
    this.rough = false;
    super.whole(pen);
  }

  rows() {
    const head = this.axes.map(({ axis }) => (axis.unit ? `${axis.label} (${axis.unit})` : axis.label));
    return [head, ...[...this.axes[0].values.keys()].filter((k) => this.model.included(k)).map((k) =>
      this.axes.map(({ axis, values }) => axis.categories?.[values[k]] ?? values[k]))];
  }
}
