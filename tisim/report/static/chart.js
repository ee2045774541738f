/* Curves against time, or another quantity, as SVG: a legend, a readout under the pointer, a mark at the time that
   is played. */

/** Round values between two ends, at most a number of them. */
function roundTicks(low, high, most) {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= rough), ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
  return ticks;
}

/** Powers of ten between two ends, at most a number of them. */
function powerTicks(low, high, most) {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)], ticks = [];
  const step = Math.max(1, Math.ceil((last - first + 1) / most));
  for (let k = first; k <= last; k += step) ticks.push(10 ** k);
  return ticks.length > 1 ? ticks : roundTicks(low, high, most);
}

/** The power of ten, a multiple of 3, in which an axis is labelled, and its prefix or power as text. */
function axisUnit(largest, unit) {
  const power = largest > 0 ? 3 * Math.floor(Math.log10(largest * (1 + 1e-12)) / 3) : 0;
  if (power === 0) return [1, raised(unit)];
  if (/^(m|s|N|J|Pa|W|m\/s|N m)$/.test(unit) && PREFIXES[power] !== undefined) return [10 ** power, PREFIXES[power] + unit];
  return Math.abs(power) < 6 && !unit ? [1, ""] : [10 ** power, `${raised(`10^${power}`)} ${raised(unit)}`.trim()];
}

const HEIGHT = 230, MARGINS = { left: 62, right: 14, top: 12, bottom: 40 };
const STROKES = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];
const TIME = { name: "time", symbol: "t", unit: "s", whole: false };

class Chart {
  /** facts : title, unit, logarithmic, curves of label and values, perhaps with low and high values of a band;
      perhaps marks of x, value, low, high and label; perhaps lines of x and label, across. times : horizontal places of the values, s.
      jump : called with a time. axis : name, symbol and unit of the horizontal axis; whole: whole numbers alone. */
  constructor(place, facts, times, jump, fileName, axis = TIME) {
    Object.assign(this, { facts, times, jump, fileName, axis, time: null });
    this.drawing = element("svg", { class: "chart", role: "img", height: HEIGHT, "aria-label": this.summary() });
    this.readout = element("div", { class: "readout" });
    const save = (text, keep) => element("button", { type: "button", onclick: keep, "aria-label": `Save ${facts.title} as ${text}` }, text);
    place.append(element("figure", {},
      element("figcaption", {}, element("span", {}, facts.title), element("span", { class: "buttons" },
        save("PNG", () => this.png()), save("SVG", () => this.svg()), save("CSV", () => this.csv()))),
      this.drawing, this.readout));
    this.drawing.addEventListener("pointermove", (event) => this.point(event));
    this.drawing.addEventListener("pointerleave", () => { this.over = null; this.readout.textContent = this.latest(); this.mark(); });
    this.drawing.addEventListener("click", () => { if (this.over !== null) this.jump(this.times[this.over]); });
    new ResizeObserver(() => this.draw()).observe(this.drawing.parentNode);
    this.over = null;
    this.draw();
  }

  summary() {
    const { title, curves, unit } = this.facts;
    return `${title} against ${this.axis.name}; ` + curves.map(({ label, values }) => {
      const known = values.filter(Number.isFinite);
      return `${label || title} from ${quantity(known[0] ?? NaN, unit)} to ${quantity(known.at(-1) ?? NaN, unit)}`;
    }).join("; ");
  }

  draw() {
    const wide = this.drawing.parentNode.clientWidth, { facts, times } = this;
    if (!wide || wide === this.wide) return;
    this.wide = wide;
    this.drawing.setAttribute("width", wide);
    this.drawing.setAttribute("viewBox", `0 0 ${wide} ${HEIGHT}`);
    const marks = facts.marks ?? [];
    const values = [...facts.curves.flatMap((one) => [...one.values, ...(one.low ?? []), ...(one.high ?? [])]),
      ...marks.flatMap((one) => [one.value, one.low, one.high])].filter((y) => Number.isFinite(y) && (!facts.logarithmic || y > 0));
    let [low, high] = values.reduce(([a, b], y) => [Math.min(a, y), Math.max(b, y)], [Infinity, -Infinity]);
    if (!(low <= high)) [low, high] = [0, 1];
    if (!facts.logarithmic) {
      if (low > 0 && low < 0.5 * high) low = 0;
      const room = (high - low || Math.abs(high) || 1) * 0.06;
      [low, high] = [low === 0 ? 0 : low - room, high + room];
    } else if (low === high) [low, high] = [low / 2, high * 2];
    const { left, right, top, bottom } = MARGINS, scale = facts.logarithmic ? Math.log : (y) => y;
    const last = Math.max(times.at(-1), ...marks.map((one) => one.x));
    const [begin, end] = [times[0], last > times[0] ? last : times[0] + 1];
    this.x = (t) => left + (t - begin) / (end - begin) * (wide - left - right);
    this.y = (y) => HEIGHT - bottom - (scale(y) - scale(low)) / (scale(high) - scale(low)) * (HEIGHT - top - bottom);
    const [byTime, timeUnit] = axisUnit(Math.max(Math.abs(begin), Math.abs(end)), this.axis.unit);
    const [by, unit] = facts.logarithmic ? [1, raised(facts.unit)] : axisUnit(Math.max(Math.abs(low), Math.abs(high)), facts.unit);
    const parts = [], text = (x, y, content, attributes = {}) => parts.push(element("text", { x, y, ...attributes }, content));
    for (const t of roundTicks(begin / byTime, end / byTime, Math.max(3, Math.floor(wide / 110)))) {
      if (this.axis.whole && t % 1) continue;
      parts.push(element("line", { class: "grid", x1: this.x(t * byTime), x2: this.x(t * byTime), y1: top, y2: HEIGHT - bottom }));
      text(this.x(t * byTime), HEIGHT - bottom + 16, number(t, 5), { "text-anchor": "middle" });
    }
    const ticks = facts.logarithmic ? powerTicks(low, high, 5) : roundTicks(low / by, high / by, 5).map((y) => y * by);
    for (const y of ticks) {
      parts.push(element("line", { class: "grid", x1: left, x2: wide - right, y1: this.y(y), y2: this.y(y) }));
      const power = facts.logarithmic && Math.log10(y) % 1 === 0 ? raised(`10^${Math.log10(y)}`) : number(y / by, 5);
      text(left - 6, this.y(y) + 4, power, { "text-anchor": "end" });
    }
    text((left + wide - right) / 2, HEIGHT - 6, timeUnit ? `${this.axis.name} (${timeUnit})` : this.axis.name, { "text-anchor": "middle" });
    if (unit) text(14, (HEIGHT - bottom + top) / 2, unit, { "text-anchor": "middle", transform: `rotate(-90 14 ${(HEIGHT - bottom + top) / 2})` });
    const drawn = (y) => Number.isFinite(y) && (!facts.logarithmic || y > 0);
    facts.curves.forEach(({ low: lows, high: highs }, k) => {
      if (!lows) return;
      const known = [...times.keys()].filter((m) => drawn(lows[m]) && drawn(highs[m]));
      const at = (ys) => (m) => `${this.x(times[m]).toFixed(1)} ${this.y(ys[m]).toFixed(1)}`;
      const outline = [...known.map(at(highs)), ...[...known].reverse().map(at(lows))];
      if (known.length) parts.push(element("path", { class: `band ${STROKES[k % STROKES.length]}`, d: `M${outline.join("L")}Z` }));
    });
    facts.curves.forEach(({ values: ys }, k) => {
      let path = "", pen = false;
      ys.forEach((y, m) => {
        const known = drawn(y);
        if (known) path += `${pen ? "L" : "M"}${this.x(times[m]).toFixed(1)} ${this.y(y).toFixed(1)}`;
        pen = known;
      });
      parts.push(element("path", { class: `curve ${STROKES[k % STROKES.length]}`, d: path }));
    });
    for (const { x, value, low: least, high: most } of marks) {
      if (!drawn(value)) continue;
      if (drawn(least) && drawn(most)) parts.push(element("line", { class: "mark", x1: this.x(x), x2: this.x(x), y1: this.y(least), y2: this.y(most) }));
      parts.push(element("circle", { class: "mark", cx: this.x(x), cy: this.y(value), r: 4 }));
    }
    for (const { x, label } of facts.lines ?? []) {
      if (x < begin || x > end) continue;
      parts.push(element("line", { class: "across", x1: this.x(x), x2: this.x(x), y1: top, y2: HEIGHT - bottom }));
      text(this.x(x) - 4, top + 2, label, { "text-anchor": "end", transform: `rotate(-90 ${this.x(x) - 4} ${top + 2})` });
    }
    if (facts.curves.length > 1) {
      let x = wide - right;
      for (const k of [...facts.curves.keys()].reverse()) {
        x -= 7 * facts.curves[k].label.length + 4;
        text(x, top + 9, facts.curves[k].label, { class: `name ${STROKES[k % STROKES.length]}` });
        x -= 8;
      }
    }
    this.cursor = element("line", { class: "cursor", y1: top, y2: HEIGHT - bottom });
    this.drawing.replaceChildren(...parts, this.cursor);
    this.readout.textContent = this.latest();
    this.mark();
  }

  /** Adds points, or replaces all. curves : label and values of each curve. */
  extend(times, curves, all = false) {
    const { facts } = this;
    if (all) facts.curves.forEach((one) => { one.values = []; });
    // All charts of a page share their first times.
    this.times = [...(all ? [] : this.times), ...times];
    for (const one of facts.curves) {
      const values = curves.find((own) => own.label === one.label)?.values ?? [];
      one.values.push(...times.map((_, k) => values[k] ?? null));
    }
    this.wide = null;
    this.drawing.setAttribute("aria-label", this.summary());
    this.draw();
  }

  nearest(time) {
    let low = 0, high = this.times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle; else high = middle;
    }
    return time - this.times[low] < this.times[high] - time ? low : high;
  }

  point(event) {
    const [first, last] = [this.x(this.times[0]), this.x(this.times.at(-1))];
    const part = Math.max(0, Math.min(1, (event.offsetX - first) / (last - first || 1)));
    this.over = this.nearest(this.times[0] + part * (this.times.at(-1) - this.times[0]));
    this.readout.textContent = this.latest();
    this.mark();
  }

  /** The values at the pointer, or at the time that is shown. */
  latest() {
    const k = this.over ?? (this.time === null ? this.times.length - 1 : this.nearest(this.time)), { unit, curves } = this.facts;
    const marks = (this.facts.marks ?? []).map((one) => `; ${one.label}: ${quantity(one.value, unit)}${one.low === null ? "" : ` (${quantity(one.low, unit)} to ${quantity(one.high, unit)})`}`).join("");
    return `${this.axis.symbol} = ${quantity(this.times[k], this.axis.unit)}: ${curves.map(({ label, values }) => `${label ? `${label} ` : ""}${quantity(values[k], unit)}`).join(", ")}${marks}`;
  }

  mark() {
    const time = this.over === null ? this.time : this.times[this.over];
    this.cursor.setAttribute("visibility", time === null ? "hidden" : "visible");
    if (time !== null) for (const end of ["x1", "x2"]) this.cursor.setAttribute(end, this.x(time));
  }

  at(time) {
    this.time = time;
    if (this.over === null) this.readout.textContent = this.latest();
    this.mark();
  }

  /** The picture with its colours written out, so that it looks the same elsewhere. */
  whole() {
    const copy = this.drawing.cloneNode(true), own = [this.drawing, ...this.drawing.querySelectorAll("*")];
    [copy, ...copy.querySelectorAll("*")].forEach((part, k) => {
      const style = getComputedStyle(own[k]);
      for (const name of ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "font-family", "font-size"]) part.setAttribute(name, style.getPropertyValue(name));
      part.removeAttribute("class");
    });
    copy.querySelector("line:last-child")?.remove();
    copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
    const ground = element("rect", { width: "100%", height: "100%", fill: getComputedStyle(document.body).backgroundColor });
    copy.prepend(ground);
    return new XMLSerializer().serializeToString(copy);
  }

  name() {
    return `${this.fileName}_${this.facts.title.replace(/[^\w]+/g, "_")}`;
  }

  svg() {
    download(`${this.name()}.svg`, this.whole(), "image/svg+xml");
  }

  png() {
    const picture = new Image(), scale = 3;
    picture.onload = () => {
      const canvas = element("canvas", { width: scale * this.wide, height: scale * HEIGHT });
      canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => download(`${this.name()}.png`, blob), "image/png");
    };
    picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(this.whole())}`;
  }

  csv() {
    const { curves, title, unit } = this.facts, named = (text) => (unit ? `${text} (${unit})` : text);
    const { axis } = this, head = axis.unit ? `${axis.name} (${axis.unit})` : axis.name;
    const columns = curves.flatMap(({ label, values, low, high }) => {
      const name = label ? `${title} ${label}` : title;
      return [[named(name), values], ...(low ? [[named(`${name}, low`), low], [named(`${name}, high`), high]] : [])];
    });
    const rows = [[head, ...columns.map(([name]) => name)]];
    this.times.forEach((time, k) => rows.push([time, ...columns.map(([, values]) => values[k])]));
    for (const { x, value, low, high, label } of this.facts.marks ?? []) rows.push([x, named(label), value, low, high]);
    download(`${this.name()}.csv`, csv(rows), "text/csv");
  }
}
