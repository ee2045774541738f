/* The controls around a viewer: playback, colours, sizes, the clipping plane, a particle's numbers, downloads. */

const CLASSES = [[68, 119, 170], [238, 102, 119], [34, 136, 51], [204, 187, 68], [102, 204, 238], [170, 51, 119],
  [187, 187, 187], [221, 136, 51], [110, 80, 160], [90, 150, 140], [180, 120, 90], [120, 120, 120]];
const SPEEDS = [0.25, 0.5, 1, 2, 4];
const FRAMES_A_SECOND = 20;
const MOST_LISTED = 6;          // contacts of a chosen particle whose forces are shown
const DARK_END = 9;             // colours of a map that are left out on a dark ground

const PLAY = "M4 2.5v11L14 8z", PAUSE = "M4 3h3v10H4z M9.5 3h3v10h-3z";

function icon(path) {
  return element("svg", { class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true" }, element("path", { d: path }));
}

class Player {
  /** place : element to fill. facts : name, colour maps, names of materials. */
  constructor(place, trajectory, scene, network, facts) {
    Object.assign(this, { place, trajectory, facts, speed: 1, playing: false, listeners: [] });
    this.canvas = element("canvas", { tabindex: 0, role: "application", "aria-label":
      "View of the particles. Arrow keys turn it, with Shift they move it; plus and minus zoom; "
      + "space plays; comma and full stop step through the frames; Home shows all." });
    this.viewer = new Viewer(this.canvas, trajectory, scene, network);
    this.network = network;
    this.scene = scene;
    this.build();
    this.listen();
    this.firstColour();
    this.viewer.show(0);
    new ResizeObserver(() => { this.viewer.resize(); this.overlay(); }).observe(this.canvas);
    this.viewer.listeners.push(() => this.overlay());
    this.go(0);
  }

  // Building

  build() {
    const { trajectory, scene } = this, last = trajectory.frames - 1;
    const choice = (label, options, change) => {
      const select = element("select", { onchange: () => change(select.value) },
        ...options.map(([value, text]) => element("option", { value }, text)));
      return { label: element("label", {}, element("span", {}, label), select), select };
    };
    const check = (label, on, change) => {
      const box = element("input", { type: "checkbox", checked: on, onchange: () => change(box.checked) });
      return element("label", { class: "check" }, box, label);
    };
    const button = (text, label, press) => element("button", { type: "button", title: label, "aria-label": label, onclick: press }, text);
    this.playButton = button(icon(PLAY), "Play", () => this.play(!this.playing));
    this.slider = element("input", { type: "range", min: 0, max: last, step: 1, value: 0, "aria-label": "Frame",
      oninput: () => { this.play(false); this.go(Number(this.slider.value)); } });
    this.clock = element("output", { class: "clock" });
    this.live = element("div", { class: "unseen", "aria-live": "polite" });
    const rate = choice("Speed", SPEEDS.map((one) => [one, `${one}\u00d7`]), (value) => { this.speed = Number(value); });
    rate.select.value = "1";
    this.legend = element("div", { class: "legend" });
    this.bar = element("div", { class: "scalebar" });
    this.triad = element("svg", { class: "triad", viewBox: "-40 -40 80 80", "aria-hidden": "true" });
    this.note = element("div", { class: "inspector", role: "status" });
    const stage = element("div", { class: "stage" }, this.canvas, this.legend, this.bar, this.triad, this.note);
    this.stage = stage;

    this.colour = choice("Colour", [], (name) => { this.chosenColour = true; this.colourBy(name); });
    this.maps = choice("Map", Object.keys(this.facts.maps).map((one) => [one, one]), () => this.applyMap());
    this.low = element("input", { type: "text", inputmode: "decimal", "aria-label": "Lower end of the colours", onchange: () => this.ranged() });
    this.high = element("input", { type: "text", inputmode: "decimal", "aria-label": "Upper end of the colours", onchange: () => this.ranged() });
    const range = element("fieldset", { class: "range" }, element("legend", {}, "Range"), this.low, element("span", {}, "to"), this.high,
      button("this frame", "Range of this frame", () => this.rangeOfFrame()));
    this.rangeBox = range;
    const sizes = choice("Size", [], (name) => this.viewer.set({ size: name || null }));
    this.sizes = sizes;
    this.offer();
    const scale = element("input", { type: "range", min: -1.5, max: 1.5, step: 0.05, value: 0, "aria-label": "Size of the particles",
      oninput: () => this.viewer.set({ scale: 2 ** Number(scale.value) }) });
    const search = element("input", { type: "text", inputmode: "numeric", size: 8, onchange: () => this.find(search.value) });
    this.search = search;

    this.cutAxis = choice("Cut", [["", "none"], ["x", "x"], ["y", "y"], ["z", "z"], ["-x", "\u2212x"], ["-y", "\u2212y"], ["-z", "\u2212z"], ["view", "as seen"]], (name) => this.cutAlong(name));
    this.cutPlace = element("input", { type: "range", min: 0, max: 1, step: 0.002, value: 0.5, "aria-label": "Place of the clipping plane", disabled: true,
      oninput: () => this.cut() });
    const shown = [];
    if (scene.bodies.length) shown.push(check("walls", true, (on) => this.viewer.set({ walls: on })));
    if (scene.box) shown.push(check("box", true, (on) => this.viewer.set({ box: on })));
    if (scene.lines) shown.push(check(`${scene.lines.name} lines at ${quantity(scene.lines.time, "s")}`, true, (on) => this.viewer.set({ lines: on })));
    if (this.network) shown.push(check("contacts", false, (on) => this.showContacts(on)));
    shown.push(check("outlines", true, (on) => this.viewer.set({ outlines: on })));
    shown.push(check("perspective", true, (on) => this.viewer.set({ flat: !on })));
    const magnets = choice("Magnets", [["solid", "solid"], ["glass", "glass"], ["", "hidden"]], (how) => this.viewer.set({ magnets: how }));
    if (scene.magnets.length) shown.unshift(magnets.label);
    // Solid magnets would hide particles that are far smaller.
    const clear = Math.min(...scene.magnets.map((one) => one.radius)) > 5 * scene.medianRadius;
    this.viewer.options.magnets = magnets.select.value = clear ? "glass" : "solid";
    const views = [["x", 0, 0], ["y", -Math.PI / 2, 0], ["z", -Math.PI / 2, Math.PI / 2]].map(([axis, azimuth, elevation]) =>
      button(axis, `Look along ${axis}`, () => this.viewer.look(azimuth, elevation)));
    const group = (name, ...parts) => element("div", { class: "group", role: "group", "aria-label": name }, ...parts);
    this.place.append(stage,
      group("Playback", element("div", { class: "transport" },
        button(icon("M4 3h2v10H4z M13 3v10L7 8z"), "First frame", () => { this.play(false); this.go(0); }), this.playButton, this.slider, this.clock), rate.label),
      element("details", { class: "settings", open: innerWidth > 700 && !document.body.classList.contains("cell") }, element("summary", {}, "Colours, sizes, cut, view, downloads"),
        element("div", { class: "columns" }, group("Colours", this.colour.label, this.maps.label, range),
        group("Sizes", sizes.label, element("label", {}, element("span", {}, "Scale"), scale), element("label", {}, element("span", {}, "Particle id"), search)),
        group("Clipping plane", this.cutAxis.label, this.cutPlace),
        group("View", ...shown, element("span", { class: "buttons" }, ...views, button("all", "Show all", () => this.home()))),
        group("Downloads", button("PNG of the view", "Save the view as PNG", () => this.png()),
          button("CSV of this frame", "Save the particles of this frame as CSV", () => this.csv()),
          ...(this.network ? [button("CSV of contacts", "Save the contacts of this frame as CSV", () => this.contactsCsv())] : [])))),
      this.live);
    if (last < 1) this.slider.disabled = true;
  }

  /** Offers the quantities that change, or differ between particles, as colours and sizes. */
  offer() {
    const changing = this.trajectory.quantities().filter((one) => !one.constant);
    const fill = ({ select }, first, columns) => {
      const { value } = select;
      select.replaceChildren(...[["", first], ...columns.map((one) => [one.name, this.label(one)])].map(([name, text]) => element("option", { value: name }, text)));
      select.value = value;
    };
    fill(this.colour, "one colour", changing);
    fill(this.sizes, "radius", changing.filter((one) => one.name !== "radius"));
  }

  firstColour() {
    const colours = this.trajectory.quantities().filter((one) => !one.constant);
    const first = ["temperature", "speed", "material", "shape", "radius"].map((name) => colours.find((one) => one.name === name)).find(Boolean);
    this.colourBy((first ?? colours[0])?.name ?? "");
  }

  /** Shows frames that have been added; scene : of these. The last frame is followed if it was shown. */
  extend(scene) {
    const { trajectory, slider, viewer } = this, last = trajectory.frames - 1, following = this.frame === Number(slider.max);
    slider.max = last;
    slider.disabled = last < 1;
    viewer.extend(scene);
    this.offer();
    const name = viewer.options.colour;
    if (!name && !this.chosenColour) this.firstColour();
    else if (name && !this.chosenRange) this.setRange(...trajectory.columns[name].shown);
    this.drawLegend();
    if (!this.playing) this.go(following ? last : Math.min(this.frame, last));
    else viewer.invalidate();
  }

  label(column) {
    const name = column.name.replace(/_size$/, " (length)").replaceAll("_", " ");
    return column.unit ? `${name} (${raised(column.unit)})` : name;
  }

  listen() {
    const { canvas, viewer } = this, pointers = new Map();
    let dragged = 0, spread = 0;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      dragged = 0;
      spread = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.offsetX - before[0], event.offsetY - before[1]], size = canvas.clientHeight;
      dragged += Math.hypot(dx, dy);
      pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (spread) viewer.zoom(spread / now);
        spread = now;
        viewer.pan(dx / size / 2, -dy / size / 2);
      } else if (event.shiftKey || event.buttons & 6) {
        viewer.pan(dx / size, -dy / size);
      } else {
        viewer.orbit(4 * dx / size, 4 * dy / size);
      }
    });
    const release = (event) => {
      if (pointers.delete(event.pointerId) && event.type === "pointerup" && dragged < 4) this.pick(event.offsetX, event.offsetY);
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      viewer.zoom(Math.exp(event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.centreOn(this.chosenRow()));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { viewer } = this, step = event.shiftKey ? 0.05 : 0.12, ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (event.key in ways) {
      const [x, y] = ways[event.key];
      if (event.shiftKey) viewer.pan(step * x, step * y); else viewer.orbit(step * x, step * y);
    } else if (event.key === "+" || event.key === "=") viewer.zoom(0.85);
    else if (event.key === "-") viewer.zoom(1 / 0.85);
    else if (event.key === " ") this.play(!this.playing);
    else if (event.key === "," || event.key === ".") { this.play(false); this.go(this.frame + (event.key === "." ? 1 : -1)); }
    else if (event.key === "Home") this.home();
    else if (event.key === "Escape") this.choose(-1);
    else return;
    event.preventDefault();
  }

  // Time

  go(frame) {
    const { trajectory } = this;
    this.frame = Math.max(0, Math.min(trajectory.frames - 1, frame));
    if (this.chosenId !== undefined) this.viewer.chosen = this.chosenRow();
    this.viewer.show(this.frame);
    const time = quantity(trajectory.times[this.frame], "s"), n = trajectory.counts[this.frame];
    this.slider.value = this.frame;
    this.clock.textContent = `t = ${time}`;
    this.slider.setAttribute("aria-valuetext", `${time}, frame ${this.frame + 1} of ${trajectory.frames}`);
    if (!this.playing) this.live.textContent = `t = ${time}, ${n} particles`;
    this.inspect();
    for (const listener of this.listeners) listener(this.frame);
  }

  play(on) {
    if (on === this.playing || (on && this.trajectory.frames < 2)) return;
    this.playing = on;
    this.playButton.replaceChildren(icon(on ? PAUSE : PLAY));
    for (const name of ["title", "aria-label"]) this.playButton.setAttribute(name, on ? "Pause" : "Play");
    if (!on) return this.go(this.frame);
    if (this.frame === this.trajectory.frames - 1) this.go(0);
    let before = performance.now(), due = 0;
    const tick = (now) => {
      if (!this.playing) return;
      due += (now - before) / 1000 * FRAMES_A_SECOND * this.speed;
      before = now;
      if (due >= 1) {
        this.viewer.touch();
        this.go(this.frame + Math.floor(due));
        due %= 1;
      }
      if (this.frame === this.trajectory.frames - 1) return this.play(false);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  // Colours

  colourBy(name) {
    const column = this.trajectory.columns[name];
    this.colour.select.value = column ? name : "";
    this.rangeBox.hidden = !column;
    this.maps.label.hidden = !column || this.isClass(column);
    this.viewer.set({ colour: column ? name : null });
    this.chosenRange = false;
    if (column) this.setRange(...column.shown);
    else this.drawLegend();
  }

  isClass(column) {
    return column.exact && column.step[0] * (column.shown[1] - column.shown[0]) < CLASSES.length;
  }

  setRange(low, high) {
    const column = this.trajectory.columns[this.viewer.options.colour];
    if (!(low < high)) [low, high] = [low - (Math.abs(low) || 1) * 1e-3, high + (Math.abs(high) || 1) * 1e-3];
    [this.low.value, this.high.value] = [low, high].map((end) => number(end, 4));
    this.rangeBox.hidden = this.isClass(column);
    this.viewer.set({ range: [low, high] });
    this.applyMap();
  }

  ranged() {
    const [low, high] = [this.low, this.high].map((input) => Number(input.value.replaceAll("\u2212", "-")));
    if (Number.isFinite(low) && Number.isFinite(high) && low < high) {
      this.chosenRange = true;
      this.setRange(low, high);
    } else this.setRange(...this.viewer.options.range);
  }

  rangeOfFrame() {
    const column = this.trajectory.columns[this.viewer.options.colour].at(this.frame), whole = this.trajectory.columns[column.name].frame(this.frame), ids = this.trajectory.columns.id.frame(this.frame);
    let low = Infinity, high = -Infinity;
    for (let row = 0; row < whole.length; row++) {
      if (!ids[row] || (column.missing && whole[row] === column.largest)) continue;
      low = Math.min(low, whole[row]);
      high = Math.max(high, whole[row]);
    }
    if (low > high) return;
    this.chosenRange = true;
    this.setRange(column.meaning(low), column.meaning(high));
  }

  applyMap() {
    const column = this.trajectory.columns[this.viewer.options.colour];
    if (column && this.isClass(column)) {
      const [low, high] = column.shown;
      this.viewer.options.range = [low, high];
      this.viewer.setMap(CLASSES.slice(0, high - low + 1), true);
    } else {
      const map = this.facts.maps[this.maps.select.value], dark = map[0].every((part) => part < 100);
      // The dark end of a map could not be seen on a dark ground.
      this.viewer.setMap(this.viewer.options.dark && dark ? map.slice(DARK_END) : map);
    }
    this.drawLegend();
  }

  drawLegend() {
    this.legend.replaceChildren();
    this.drawColours();
    const scale = this.forceScale();
    if (scale) {
      const strip = element("div", { class: "strip" });
      strip.style.background = `linear-gradient(to right, ${scale.colours.map((rgb) => `rgb(${rgb})`).join(",")})`;
      this.legend.append(element("div", { class: "name" }, scale.name), strip,
        element("div", { class: "ends" }, ...scale.ends.map((text) => element("span", {}, text))));
    }
    this.legend.hidden = !this.legend.childElementCount;
  }

  drawColours() {
    const { options } = this.viewer, column = this.trajectory.columns[options.colour];
    if (!column) return;
    const ends = options.range.map(Math.abs), name = this.label({ ...column, unit: "" });
    const [by, unit] = options.discrete || column.logarithmic ? [1, raised(column.unit)] : axisUnit(Math.max(...ends), column.unit);
    const notes = [unit, column.logarithmic ? "logarithmic" : ""].filter(Boolean).join(", ");
    this.legend.append(element("div", { class: "name" }, notes ? `${name} (${notes})` : name));
    if (options.discrete) {
      options.map.forEach((rgb, k) => {
        const swatch = element("span", { class: "swatch" }), value = column.shown[0] + k;
        swatch.style.background = `rgb(${rgb})`;
        const name = column.name === "material" ? this.facts.materials[value] : null;
        this.legend.append(element("div", {}, swatch, name ?? String(value)));
      });
      return;
    }
    const strip = element("div", { class: "strip" });
    strip.style.background = `linear-gradient(to right, ${options.map.map((rgb) => `rgb(${rgb})`).join(",")})`;
    this.legend.append(strip, element("div", { class: "ends" }, ...this.ticks(column).map((value) => element("span", {}, number(value / by, 3)))));
  }

  /** Values at the ends and in the middle of the legend. */
  ticks(column) {
    const [low, high] = this.viewer.options.range;
    return [low, column.logarithmic ? Math.sqrt(Math.max(low, 1e-300) * high) : (low + high) / 2, high];
  }

  // Contacts

  showContacts(on) {
    this.viewer.set({ contacts: on });
    this.drawLegend();
    this.inspect();
  }

  /** Name, colours [r, g, b] in 0..255 and labels of the scale of forces; null if no forces are shown. */
  forceScale() {
    const { viewer } = this, usual = viewer.usualForce();
    if (!viewer.options.contacts || !usual) return null;
    const [by, unit] = axisUnit(usual, "N"), { weak, strong, pull } = viewer.forceColours(), both = viewer.attracts();
    return {
      name: `contact force (${unit})`,
      colours: (both ? [pull, weak, strong] : [weak, strong]).map((rgb) => rgb.map((x) => Math.round(255 * x))),
      ends: (both ? [-usual, 0, usual] : [0, usual / 2, usual]).map((force) => number(force / by, 3)),
    };
  }

  /** The contacts of this frame, or those of a row: ids and force in N, the strongest first. */
  contacts(row = null) {
    const { trajectory, frame } = this, found = [], id = (one) => trajectory.id(frame, one);
    this.viewer.contacts()?.each(trajectory.at(frame).frame, (i, j, force) => {
      if (row === null || row === i) found.push([id(i), id(j), force]);
      else if (row === j) found.push([id(j), id(i), force]);
    });
    return found.sort((a, b) => Math.abs(b[2]) - Math.abs(a[2]));
  }

  contactsCsv() {
    const known = this.viewer.usualForce() > 0, rows = this.contacts().map((one) => (known ? one : one.slice(0, 2)));
    download(`${this.fileName()}_contacts.csv`, csv([["id", "other id", ...(known ? ["normal force (N)"] : [])], ...rows]), "text/csv");
  }

  // The clipping plane

  cutAlong(name) {
    this.cutPlace.disabled = !name;
    if (!name) return this.viewer.set({ cut: null });
    const sign = name.startsWith("-") ? -1 : 1, axis = "xyz".indexOf(name.at(-1));
    this.cutNormal = name === "view" ? this.viewer.axes().towards : [0, 1, 2].map((k) => (k === axis ? sign : 0));
    this.cutPlace.value = 0.5;
    this.cut();
  }

  cut() {
    const { low, high } = this.scene.focus, corners = [];
    for (let k = 0; k < 8; k++) corners.push([0, 1, 2].reduce((sum, m) => sum + this.cutNormal[m] * (k >> m & 1 ? high : low)[m], 0));
    const [least, most] = [Math.min(...corners), Math.max(...corners)];
    this.viewer.set({ cut: { normal: this.cutNormal, distance: least + Number(this.cutPlace.value) * (most - least) } });
  }

  home() {
    this.viewer.home();
  }

  // One particle

  chosenRow() {
    return this.chosenId === undefined ? -1 : this.trajectory.row(this.frame, this.chosenId);
  }

  pick(x, y) {
    const ratio = this.canvas.width / this.canvas.clientWidth;
    this.choose(this.viewer.pick(x * ratio, y * ratio));
  }

  find(text) {
    const id = Number(text);
    if (text.trim() === "" || !Number.isInteger(id)) return this.choose(-1);
    this.chosenId = id;
    this.viewer.chosen = this.chosenRow();
    this.viewer.invalidate();
    this.inspect();
  }

  choose(row) {
    this.chosenId = row < 0 ? undefined : this.trajectory.id(this.frame, row);
    this.search.value = this.chosenId ?? "";
    this.viewer.chosen = row;
    this.viewer.invalidate();
    this.inspect();
  }

  centreOn(row) {
    if (row < 0) return;
    this.viewer.camera.target = this.viewer.relative(this.trajectory.position(this.frame, row));
    this.viewer.touch();
  }

  /** The numbers of the chosen particle: name and text. */
  numbers(row) {
    const { trajectory, frame } = this, position = trajectory.columns.position;
    const rows = "xyz".split("").map((axis, k) => [axis, `${number(position.value(frame, row, k), 6)} m`]);
    for (const column of trajectory.quantities()) {
      const value = column.value(frame, row), name = column.name === "material" ? this.facts.materials[value] : null;
      rows.push([this.label(column).replace(/ \([^(]*\)$/, ""), name ?? `${number(value, column.exact ? 9 : 4)} ${raised(column.unit)}`.trim()]);
    }
    if (this.viewer.options.contacts) {
      const found = this.contacts(row), known = this.viewer.usualForce() > 0;
      rows.push(["contacts", `${found.length}`]);
      for (const [, other, force] of known ? found.slice(0, MOST_LISTED) : []) rows.push([`force with ${other}`, quantity(force, "N")]);
    }
    return rows;
  }

  inspect() {
    const row = this.chosenRow();
    this.note.hidden = this.chosenId === undefined;
    if (this.note.hidden) return;
    const close = element("button", { type: "button", class: "close", "aria-label": "Close", onclick: () => this.choose(-1) }, "\u00d7");
    const rows = row < 0 ? [["", "not in this frame"]] : this.numbers(row);
    this.note.replaceChildren(element("div", { class: "name" }, `particle ${this.chosenId}`, close),
      element("table", {}, ...rows.map(([name, text]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, text)))));
  }

  // Axes and scale bar

  overlay() {
    const metres = this.viewer.metresPerPixel() * this.canvas.width / Math.max(this.canvas.clientWidth, 1);
    const most = 0.22 * this.canvas.clientWidth * metres, power = 10 ** Math.floor(Math.log10(most));
    const length = power * [5, 2, 1].find((k) => k * power <= most);
    this.barLength = length;
    this.bar.style.width = `${length / metres}px`;
    this.bar.textContent = quantity(length, "m", 3);
    const { right, up, towards } = this.viewer.axes();
    const fall = this.scene.gravity, size = Math.hypot(...fall);
    const arrows = [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]], ...(size ? [["g", fall.map((x) => x / size)]] : [])];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    this.triad.replaceChildren(...arrows.map(([name, way]) => ({ name, x: dot(way, right), y: -dot(way, up), z: dot(way, towards) }))
      .sort((a, b) => a.z - b.z).map(({ name, x, y }) => element("g", { class: `axis-${name}` },
        element("line", { x1: 0, y1: 0, x2: 24 * x, y2: 24 * y }), element("text", { x: 33 * x, y: 33 * y + 4 }, name))));
  }

  // Downloads

  png() {
    const { viewer, canvas } = this;
    viewer.draw(viewer.bestSamples());
    const ratio = canvas.width / canvas.clientWidth, picture = element("canvas", { width: canvas.width, height: canvas.height });
    const pen = picture.getContext("2d"), style = getComputedStyle(this.stage);
    pen.drawImage(canvas, 0, 0);
    pen.scale(ratio, ratio);
    pen.fillStyle = style.color;
    pen.font = `14px ${style.fontFamily}`;
    pen.fillText(`${this.facts.name}, ${this.clock.textContent}`, 14, 26);
    const { options } = viewer, column = this.trajectory.columns[options.colour], bottom = canvas.clientHeight - 16;
    if (column) {
      const n = options.map.length, wide = options.discrete ? 20 * n : 180;
      pen.fillText(this.label(column), 14, bottom - 36);
      options.map.forEach((rgb, k) => {
        pen.fillStyle = `rgb(${rgb})`;
        pen.fillRect(14 + wide * k / n, bottom - 28, wide / n + 0.5, 10);
      });
      pen.fillStyle = style.color;
      pen.font = `12px ${style.fontFamily}`;
      const ends = this.ticks(column);
      pen.fillText(number(ends[0], 3), 14, bottom);
      pen.textAlign = "right";
      pen.fillText(number(ends[2], 3), 14 + wide, bottom);
    }
    const forces = this.forceScale();
    if (forces) {
      const top = column ? bottom - 88 : bottom - 28, ramp = pen.createLinearGradient(14, 0, 194, 0);
      forces.colours.forEach((rgb, k) => ramp.addColorStop(k / (forces.colours.length - 1), `rgb(${rgb})`));
      pen.fillStyle = ramp;
      pen.fillRect(14, top, 180, 10);
      pen.fillStyle = style.color;
      pen.textAlign = "left";
      pen.font = `14px ${style.fontFamily}`;
      pen.fillText(forces.name, 14, top - 8);
      pen.font = `12px ${style.fontFamily}`;
      pen.fillText(forces.ends[0], 14, top + 28);
      pen.textAlign = "right";
      pen.fillText(forces.ends[2], 194, top + 28);
    }
    const long = this.bar.clientWidth, right = canvas.clientWidth - 16;
    pen.textAlign = "center";
    pen.fillRect(right - long, bottom - 3, long, 2);
    pen.fillText(this.bar.textContent, right - long / 2, bottom - 9);
    picture.toBlob((blob) => download(`${this.fileName()}.png`, blob), "image/png");
  }

  fileName() {
    return `${this.facts.name.replace(/[^\w.-]+/g, "_")}_${String(this.trajectory.indices[this.frame]).padStart(5, "0")}`;
  }

  /** The particles of this frame, as shown. */
  csv() {
    const { trajectory, frame } = this, columns = trajectory.quantities();
    const rows = [["id", "x (m)", "y (m)", "z (m)", ...columns.map((one) => (one.unit ? `${one.name} (${one.unit})` : one.name))]];
    for (let row = 0; row < trajectory.particles; row++) {
      const id = trajectory.id(frame, row);
      if (id >= 0) rows.push([id, ...trajectory.position(frame, row), ...columns.map((one) => one.value(frame, row))]);
    }
    download(`${this.fileName()}.csv`, csv(rows), "text/csv");
  }

  theme(dark) {
    this.viewer.set({ dark });
    this.applyMap();
  }
}
