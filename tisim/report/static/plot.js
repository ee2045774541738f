/* Plots of thousands of points: drawn on a canvas, and by the same code as SVG for a file. */

const FONT = "system-ui, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";

/** Draws on a canvas; style : stroke, fill, width, alpha, dash. */
class CanvasPen {
  constructor(context) {
    this.context = context;
  }

  paint({ stroke, fill, width = 1, alpha = 1, dash = [] }) {
    const { context } = this;
    context.globalAlpha = alpha;
    if (fill) {
      context.fillStyle = fill;
      context.fill();
    }
    if (stroke) {
      Object.assign(context, { strokeStyle: stroke, lineWidth: width });
      context.setLineDash(dash);
      context.stroke();
    }
  }

  line(points, style) {
    this.context.beginPath();
    points.forEach(([x, y], k) => (k ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
    this.paint(style);
  }

  circle(x, y, radius, style) {
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.paint(style);
  }

  rect(x, y, wide, high, style) {
    this.context.beginPath();
    this.context.rect(x, y, wide, high);
    this.paint(style);
  }

  /** anchor : start, middle or end; turn : degrees. */
  text(x, y, content, { fill, size = 12, anchor = "start", turn = 0, bold = false }) {
    const { context } = this;
    context.save();
    context.translate(x, y);
    context.rotate(turn * Math.PI / 180);
    Object.assign(context, { globalAlpha: 1, fillStyle: fill, font: `${bold ? "600 " : ""}${size}px ${FONT}`, textAlign: anchor === "middle" ? "center" : anchor });
    context.fillText(content, 0, 0);
    context.restore();
  }
}

/** Draws the same as the text of an SVG. */
class SvgPen {
  constructor(wide, high) {
    this.drawing = element("svg", { xmlns: "http://www.w3.org/2000/svg", width: wide, height: high, viewBox: `0 0 ${wide} ${high}`, "font-family": FONT });
  }

  add(tag, attributes, { stroke = "none", fill = "none", width = 1, alpha = 1, dash = [] }) {
    this.drawing.append(element(tag, { ...attributes, stroke, fill, "stroke-width": stroke === "none" ? null : width,
      opacity: alpha === 1 ? null : alpha, "stroke-dasharray": dash.length ? dash.join(" ") : null }));
  }

  line(points, style) {
    this.add("path", { d: points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("") }, style);
  }

  circle(x, y, radius, style) {
    this.add("circle", { cx: x.toFixed(1), cy: y.toFixed(1), r: radius }, style);
  }

  rect(x, y, wide, high, style) {
    this.add("rect", { x, y, width: wide, height: high }, style);
  }

  text(x, y, content, { fill, size = 12, anchor = "start", turn = 0, bold = false }) {
    this.drawing.append(element("text", { x, y, fill, "font-size": size, "text-anchor": anchor, "font-weight": bold ? 600 : null,
      transform: turn ? `rotate(${turn} ${x} ${y})` : null }, content));
  }

  toString() {
    return new XMLSerializer().serializeToString(this.drawing);
  }
}

/** Values 1, 2, 5, 10 ... between two ends, or evenly spaced ones if these are fewer than two. */
function roundLogarithmicTicks(low, high) {
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)); 10 ** power <= high; power++) {
    ticks.push(...[1, 2, 5].map((k) => k * 10 ** power).filter((value) => value >= low && value <= high));
  }
  return ticks.length > 1 ? ticks : roundTicks(low, high, 4);
}

/** An axis of values: its ends, a logarithm if asked, and the categories if the values are their numbers. */
class Axis {
  /** facts : label, unit, perhaps logarithmic, categories, ends (low, high); values : all that are shown. */
  constructor(facts, values) {
    Object.assign(this, { label: "", unit: "", logarithmic: false, categories: null }, facts);
    if (this.categories) this.ends = [-0.5, this.categories.length - 0.5];
    if (this.ends) return;
    let low = Infinity, high = -Infinity;
    for (const value of values) {
      if (!this.known(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    if (!(low <= high)) [low, high] = [this.logarithmic ? 0.1 : 0, 1];
    const room = 0.04 * (this.scale(high) - this.scale(low)) || (this.logarithmic ? 0.5 : 0.05 * Math.abs(low) || 1);
    this.ends = [this.unscale(this.scale(low) - room), this.unscale(this.scale(high) + room)];
  }

  known(value) {
    return Number.isFinite(value) && (!this.logarithmic || value > 0);
  }

  scale(value) {
    return this.logarithmic ? Math.log(value) : value;
  }

  unscale(value) {
    return this.logarithmic ? Math.exp(value) : value;
  }

  /** The place of a value, 0 at the lower end and 1 at the upper. */
  place(value) {
    const [low, high] = this.ends.map((end) => this.scale(end));
    return (this.scale(value) - low) / (high - low || 1);
  }

  value(place) {
    const [low, high] = this.ends.map((end) => this.scale(end));
    return this.unscale(low + place * (high - low));
  }

  /** Pairs of value and text, at most a number of them; and the label with its unit. */
  ticks(most) {
    const name = (unit) => (unit ? `${this.label} (${unit})` : this.label);
    if (this.categories) {
      const step = Math.ceil(this.categories.length / most);
      return { label: name(raised(this.unit)), ticks: this.categories.map((text, k) => [k, text]).filter(([k]) => k % step === 0) };
    }
    const [low, high] = this.ends;
    if (this.logarithmic) {
      const wide = high > 300 * low, values = wide ? powerTicks(low, high, most) : roundLogarithmicTicks(low, high);
      return { label: name(raised(this.unit)), ticks: values.map((value) => [value, wide ? raised(`10^${Math.round(Math.log10(value))}`) : number(value, 3)]) };
    }
    const [by, unit] = axisUnit(Math.max(Math.abs(low), Math.abs(high)), this.unit);
    return { label: name(unit), ticks: roundTicks(low / by, high / by, most).map((value) => [value * by, number(value, 5)]) };
  }

  text(value) {
    if (this.categories) return this.categories[value] ?? "none";
    return quantity(value, this.unit);
  }
}

/** The colours of the page now: as names in the style, such as ink. */
function inks() {
  const style = getComputedStyle(document.documentElement), name = (one) => style.getPropertyValue(`--${one}`).trim();
  return Object.fromEntries(["ground", "panel", "ink", "quiet", "line", "accent", "bad", "c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"].map((one) => [one, name(one)]));
}

/** A figure with a canvas, and above it a canvas for all that follows the pointer. */
class Plot {
  /** options : title, file (name), height, label (for screen readers), perhaps the least width. */
  constructor(place, options) {
    Object.assign(this, { options, wide: 0, high: options.height });
    this.canvas = element("canvas", { class: "plot", "aria-hidden": "true" });
    this.above = element("canvas", { class: "plot above", tabindex: 0, role: "application", "aria-label": options.label });
    this.readout = element("div", { class: "readout", "aria-live": "polite" });
    const save = (text, keep) => element("button", { type: "button", onclick: keep, "aria-label": `Save ${options.title} as ${text}` }, text);
    this.figure = element("figure", {},
      element("figcaption", {}, element("span", {}, options.title), element("span", { class: "buttons" },
        save("PNG", () => this.png()), save("SVG", () => this.svg()), save("CSV", () => this.csv()))),
      element("div", { class: "layers" }, this.canvas, this.above), this.readout);
    place.append(this.figure);
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentNode);
    // A figure that is out of sight is drawn when it comes into view.
    this.seen = true;
    this.stale = null;
    new IntersectionObserver(([entry]) => {
      this.seen = entry.isIntersecting;
      if (this.seen && this.stale) this[this.stale]();
    }, { rootMargin: "200px" }).observe(this.canvas);
  }

  resize() {
    const room = this.canvas.parentNode.clientWidth, wide = Math.max(room, this.options.least ?? 0);
    if (!room || wide === this.wide) return;
    this.wide = wide;
    for (const canvas of [this.canvas, this.above]) {
      Object.assign(canvas, { width: wide * devicePixelRatio, height: this.high * devicePixelRatio });
      Object.assign(canvas.style, { width: `${wide}px`, height: `${this.high}px` });
    }
    this.arrange();
    this.paint();
  }

  pen(canvas) {
    // Thousands of small shapes are faster in memory than sent to a graphics card, or to what stands for one.
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    context.globalAlpha = 1;
    context.clearRect(0, 0, this.wide, this.high);
    return new CanvasPen(context);
  }

  paint() {
    if (!this.wide) return;
    this.stale = null;
    this.draw(this.pen(this.canvas), inks());
    this.point();
  }

  /** Draws again before the next picture of the browser, once however often it is asked. */
  repaint() {
    if (!this.seen) this.stale = "paint";
    if (this.asked || !this.seen) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.paint(); });
  }

  point() {
    if (!this.seen) this.stale ??= "point";
    else if (this.wide) {
      if (this.stale === "point") this.stale = null;
      this.drawAbove(this.pen(this.above), inks());
    }
  }

  name() {
    return this.options.file.replace(/[^\w.-]+/g, "_");
  }

  /** Everything that is shown, with a ground, by a pen. */
  whole(pen) {
    const colours = inks();
    pen.rect(0, 0, this.wide, this.high, { fill: colours.panel });
    this.draw(pen, colours);
    this.drawAbove(pen, colours);
  }

  png() {
    const scale = 3, canvas = element("canvas", { width: scale * this.wide, height: scale * this.high }), context = canvas.getContext("2d");
    context.scale(scale, scale);
    this.whole(new CanvasPen(context));
    canvas.toBlob((blob) => download(`${this.name()}.png`, blob), "image/png");
  }

  svg() {
    const pen = new SvgPen(this.wide, this.high);
    this.whole(pen);
    download(`${this.name()}.svg`, String(pen), "image/svg+xml");
  }

  csv() {
    download(`${this.name()}.csv`, csv(this.rows()), "text/csv");
  }
}
