/* The page of a search: its designs in plots and a table that choose one together, and all about the chosen one. */

const BEST_SHARE = 0.95;        // colours end where this share of the designs is better
const FEW = 400;                // up to this number of designs, all have error bars
const FIRST_PAIRS = 4;          // genes in the pair plots at first

/** What a search has found, by design. */
class Designs extends Choice {
  /** facts : columns of genes, objectives, constraints; gen, rank, best, starts, freshStarts, failed, runs. */
  constructor(facts) {
    super();
    Object.assign(this, facts.designs);
    const places = (one) => (one.choices ? one.values.map((value) => one.choices.indexOf(value)) : one.values.map((value) => value ?? NaN));
    for (const one of this.genes) one.places = places(one);
    for (const one of [...this.objectives, ...this.constraints]) {
      for (const name of ["values", "errors", "fresh", "low", "high"]) one[name] = one[name]?.map((value) => value ?? NaN) ?? null;
      one.reported = one.values.map((value, k) => (one.fresh && Number.isFinite(one.fresh[k]) ? one.fresh[k] : value));
    }
    this.count = this.gen.length;
    this.included = new Uint8Array(this.count).fill(1);
  }

  axis(one) {
    return { label: one.name, unit: one.unit, logarithmic: one.logarithmic, categories: one.choices?.map(String) ?? null };
  }

  /** The interval of a value: from held-out starts, or the standard error of its mean; null if not known. */
  interval(one, k) {
    if (one.low && Number.isFinite(one.low[k]) && Number.isFinite(one.high[k])) return [one.low[k], one.high[k]];
    const error = one.errors[k];
    return error > 0 ? [one.values[k] - error, one.values[k] + error] : null;
  }

  named(k) {
    return `design ${k + 1}`;
  }

  valueText(one, k) {
    return `${one.name} ${quantity(one.reported[k], one.unit)}`;
  }

  geneText(one, k) {
    const value = one.values[k];
    return typeof value === "number" ? quantity(value, one.unit) : String(value);
  }

  describe(k) {
    const parts = [this.named(k), ...this.objectives.map((one) => this.valueText(one, k)), ...this.genes.filter((one) => one.varied).map((one) => `${one.name} ${this.geneText(one, k)}`)];
    return this.failed[k] ? `${this.named(k)} failed: ${this.failed[k]}` : parts.join(", ");
  }
}

/** Colours of designs by a value: the best in the strongest colour on either ground. */
class Shades {
  constructor(designs, map) {
    Object.assign(this, { designs, map });
    this.by(designs.objectives[0]);
  }

  by(one) {
    this.one = one;
    const known = one.reported.filter(Number.isFinite).sort((a, b) => (one.largest ? b - a : a - b));
    this.ends = [known[0] ?? 0, known[Math.floor(BEST_SHARE * (known.length - 1))] ?? 1];
    this.logarithmic = known.length > 0 && Math.min(...this.ends) > 0 && Math.max(...this.ends) > 100 * Math.min(...this.ends);
  }

  /** 1 for the best, 0 for the worst, NaN if not known. */
  worth(k) {
    const scale = (x) => (this.logarithmic ? Math.log(Math.max(x, 1e-300)) : x), [best, worst] = this.ends.map(scale);
    return best === worst ? 1 : Math.max(0, Math.min(1, (scale(this.one.reported[k]) - worst) / (best - worst)));
  }

  colour(k) {
    return this.at(this.worth(k));
  }

  at(worth) {
    if (!Number.isFinite(worth)) return "#888888";
    const dark = document.documentElement.dataset.theme === "dark", last = this.map.length - 1;
    // The end of the map that is near the ground would be invisible.
    const place = dark ? 0.18 + 0.82 * worth : 0.92 * (1 - worth);
    return `rgb(${this.map[Math.round(last * place)]})`;
  }

  legend() {
    const strip = element("div", { class: "strip" });
    strip.style.background = `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map((worth) => this.at(worth)).join(",")})`;
    const [best, worst] = this.ends.map((end) => quantity(end, this.one.unit, 3));
    return element("div", { class: "shades" }, strip, element("div", { class: "ends" }, element("span", {}, `${worst} and worse`), element("span", {}, `best ${best}`)));
  }
}

/** The start and the end of a recorded design side by side; the end can be played. */
class Clouds {
  constructor(place, facts, bytes) {
    Object.assign(this, { place, facts, bytes, shown: -1 });
    let begin = 0;
    this.begin = facts.recordings.map((one) => {
      const here = begin;
      begin += one.lengths.reduce((a, b) => a + b, 0);
      return here;
    });
  }

  release() {
    for (const viewer of [this.start, this.player?.viewer]) viewer?.release();
    this.player?.play(false);
    this.start = this.player = null;
  }

  async show(k, name, choose) {
    const at = this.facts.recordings.findIndex((one) => one.design === k);
    if (at === this.shown && at >= 0) return;
    this.shown = at;
    this.release();
    if (at < 0) {
      const buttons = this.facts.recordings.map((one) => element("button", { type: "button", onclick: () => choose(one.design) }, `design ${one.design + 1}`));
      return this.place.replaceChildren(element("p", {}, `The page has no clouds of ${name}; it has them of`), element("div", { class: "buttons" }, ...buttons));
    }
    const facts = this.facts.recordings[at], { trajectory, network } = await decodeRun(facts, this.bytes.subarray(this.begin[at]));
    if (this.shown !== at) return;
    const canvas = element("canvas", { role: "img", "aria-label": `Start of ${name}, in the view beside it` });
    const left = element("div", { class: "stage" }, canvas), right = element("div", { class: "player" });
    this.place.replaceChildren(element("p", { class: "quiet" }, facts.about), element("div", { class: "sides" },
      element("figure", {}, element("figcaption", {}, `${name}: start`), left), element("figure", {}, element("figcaption", {}, `${name}: playback to the end`), right)));
    try {
      this.player = new Player(right, trajectory, facts.scene, network, { ...facts, maps: this.facts.maps });
      this.start = new Viewer(canvas, trajectory, facts.scene, network);
    } catch (error) {
      return this.place.replaceChildren(element("p", { class: "warning", role: "alert" }, `The particles cannot be shown: ${error.message}`));
    }
    right.querySelector("details").open = false;
    this.player.theme(document.documentElement.dataset.theme === "dark");
    this.player.viewer.listeners.push(() => this.follow());
    this.player.go(trajectory.frames - 1);
    new ResizeObserver(() => { this.start?.resize(); this.follow(); }).observe(canvas);
  }

  /** Draws the start from where the end is seen, in the same colours. */
  follow() {
    const { start, player } = this;
    if (!start || !player) return;
    const { viewer } = player;
    Object.assign(start.camera, viewer.camera);
    if (start.options.map !== viewer.options.map && viewer.options.map) start.setMap(viewer.options.map, viewer.options.discrete);
    Object.assign(start.options, viewer.options);
    start.show(0);
    start.draw(viewer.moving ? 1 : start.bestSamples());
  }

  theme(dark) {
    this.player?.theme(dark);
  }
}

/** The panel with everything about the chosen design. */
class Panel {
  constructor(place, facts, designs, table) {
    Object.assign(this, { place, facts, designs, table });
  }

  show(k) {
    const { designs, facts } = this, button = (text, label, step) => element("button", { type: "button", "aria-label": label, onclick: () => designs.choose(this.table.next(k, step)) }, text);
    const rank = designs.rank[k] ? `${facts.several ? "on the front" : `rank ${designs.rank[k]}`}${designs.best[k] ? (facts.several ? ", nearest to the best of each" : ", the best") : ""}` : `generation ${designs.gen[k]}`;
    this.place.replaceChildren(
      element("h2", {}, `Design ${k + 1}`), element("p", { class: "quiet" }, rank),
      element("div", { class: "buttons" }, button("\u2039 before", "Design before in the table", -1), button("after \u203a", "Design after in the table", 1)),
      ...(designs.failed[k] ? [element("p", { class: "warning failed" }, `It failed: ${designs.failed[k]}`)] : [this.values(k), this.accuracy(k)]),
      element("h3", {}, "Genes"), this.genes(k), this.cost(k), ...this.scene(k));
  }

  cells(...texts) {
    return texts.map((text, k) => element(k ? "td" : "th", { scope: k ? null : "row", class: k ? "number" : null }, text));
  }

  values(k) {
    const { designs } = this, fresh = designs.freshStarts[k];
    const row = (one) => {
      const own = `${quantity(one.values[k], one.unit)}${one.errors[k] > 0 ? ` \u00b1 ${quantity(one.errors[k], one.unit, 2)}` : ""}`;
      const again = !fresh || !one.fresh ? "none" : `${quantity(one.fresh[k], one.unit)}${Number.isFinite(one.low[k]) ? ` (${quantity(one.low[k], one.unit)} to ${quantity(one.high[k], one.unit)})` : ""}`;
      return element("tr", {}, ...this.cells(one.name, own, again));
    };
    const head = ["", `${designs.starts[k]} start${designs.starts[k] === 1 ? "" : "s"}`, fresh ? `${fresh} fresh starts` : "fresh starts"];
    return element("table", {}, element("thead", {}, element("tr", {}, ...head.map((text, c) => element("th", { scope: "col", class: c ? "number" : null }, text)))),
      element("tbody", {}, ...[...designs.objectives, ...designs.constraints].map(row)));
  }

  accuracy(k) {
    const { designs } = this, parts = [];
    if (designs.constraints.length) parts.push(`Feasible: ${designs.feasible[k]}.`);
    if (designs.objectives.some((one) => one.errors[k] > 0)) parts.push("\u00b1 is the standard error over the starts that also chose the designs, so the best values are partly luck.");
    parts.push(designs.freshStarts[k] ? "Fresh starts were held out: their mean is unbiased, with its 95 % interval." : "It was not run from held-out starts.");
    return element("p", { class: "quiet" }, parts.join(" "));
  }

  genes(k) {
    const rows = this.designs.genes.map((one) => {
      const bounds = one.choices ? one.choices.join(", ") : one.low === null ? "" : `${number(one.low)} to ${number(one.high)}${one.logarithmic ? ", log" : ""}`;
      const bar = element("div", { class: "bar", "aria-hidden": "true" }), place = one.low === null || one.choices ? null : one.logarithmic
        ? Math.log(one.values[k] / one.low) / Math.log(one.high / one.low) : (one.values[k] - one.low) / (one.high - one.low);
      if (place !== null) {
        const mark = element("span");
        mark.style.left = `${100 * place}%`;
        bar.append(mark);
      }
      return element("tr", {}, element("th", { scope: "row" }, one.name), element("td", { class: "number" }, typeof one.values[k] === "number" ? `${number(one.values[k], 6)} ${raised(one.unit)}`.trim() : String(one.values[k])),
        element("td", {}, place === null ? null : bar, element("span", { class: "quiet" }, one.varied ? bounds : "fixed")));
    });
    return element("table", {}, element("thead", {}, element("tr", {}, ...["gene", "value", "range"].map((text, c) => element("th", { scope: "col", class: c === 1 ? "number" : null }, text)))), element("tbody", {}, ...rows));
  }

  /** Runs and their time, with a table of the starts. */
  cost(k) {
    const runs = this.designs.runs[k], { quantities } = this.facts, seconds = runs.reduce((sum, run) => sum + run.wall, 0);
    const head = ["start", "seed", ...quantities, "time (s)"], cells = (run) => [run.fresh ? `fresh ${run.start}` : String(run.start), run.seed, ...run.values.map((value) => (value === null ? run.reason || "none" : number(value, 6))), number(run.wall, 3)];
    return element("div", {}, element("h3", {}, "Cost"), element("p", {}, `${runs.length} runs, ${quantity(seconds, "s", 3)} of wall time.`),
      element("details", {}, element("summary", {}, "All starts"), element("div", { class: "buttons" }, element("button", { type: "button", "aria-label": `Save the starts of design ${k + 1} as CSV`,
        onclick: () => download(`design_${k + 1}_starts.csv`, csv([head, ...runs.map((run) => [run.start, run.seed, ...run.values, run.wall])]), "text/csv") }, "CSV")),
      element("div", { class: "wide" }, element("table", {}, element("thead", {}, element("tr", {}, ...head.map((text) => element("th", { scope: "col" }, text)))),
        element("tbody", {}, ...runs.map((run) => element("tr", {}, ...this.cells(...cells(run)))))))));
  }

  /** How to repeat the design: its scene, or the call that makes it. */
  scene(k) {
    const { designs, facts } = this, toml = facts.scenes[k], python = (value) => (typeof value === "boolean" ? (value ? "True" : "False") : JSON.stringify(value));
    const genes = designs.genes.map((one) => `    ${JSON.stringify(one.name)}: ${python(one.values[k])},`).join("\n"), seed = designs.runs[k][0]?.seed ?? 0;
    const text = (content, file, title, open) => {
      const pre = element("pre", { tabindex: 0, "aria-label": title }, content);
      return element("details", { open }, element("summary", {}, title), copying(pre, file), pre);
    };
    const table = csv([designs.genes.map((one) => (one.unit ? `${one.name} (${one.unit})` : one.name)), designs.genes.map((one) => one.values[k])]);
    const command = facts.command ? `${facts.command} --start-from design_${k + 1}.csv` : null;
    return [element("h3", {}, "Scene"),
      toml ? text(toml, `design_${k + 1}.toml`, "Scene of its first start, for tisim run", true) : null,
      text(`design = {\n${genes}\n}\nscene = problem.scene(design, ${seed})`, `design_${k + 1}.py`, "In Python, with the problem of this search", !toml),
      element("div", { class: "buttons" }, element("button", { type: "button", onclick: () => download(`design_${k + 1}.csv`, table, "text/csv") }, "Save the genes as CSV")),
      command ? element("p", { class: "quiet" }, "A search that begins with it: ", element("code", {}, command)) : null].filter(Boolean);
  }
}

/** The columns of the table of designs. */
function designColumns(designs, facts) {
  const named = (one, after = "") => `${one.name}${after}${one.unit ? ` (${raised(one.unit)})` : ""}`;
  const numbers = (head, values, digits = 5) => ({ head, number: true, value: (k) => values[k], text: (k) => (Number.isFinite(values[k]) ? number(values[k], digits) : "") });
  const texts = (head, values) => ({ head, number: false, value: (k) => values[k], text: (k) => String(values[k]) });
  const of = (one) => [numbers(named(one), one.values), numbers(named(one, " std. error"), one.errors, 2),
    ...(one.fresh ? [numbers(named(one, ", fresh starts"), one.fresh), numbers(named(one, " 95 % low"), one.low), numbers(named(one, " 95 % high"), one.high)] : [])];
  const count = [...Array(designs.count).keys()], rank = designs.rank.map((one) => one || NaN);
  return [numbers("design", count.map((k) => k + 1)), numbers(facts.several ? "front" : "rank", rank), ...designs.objectives.flatMap(of), ...designs.constraints.flatMap(of),
    ...(designs.constraints.length ? [texts("feasible", designs.feasible)] : []),
    ...designs.genes.map((one) => (one.choices ? texts(named(one), one.values) : numbers(named(one), one.values))),
    numbers("generation", designs.gen), numbers("starts", designs.starts), numbers("runs", designs.runs.map((one) => one.length)),
    numbers("wall time (s)", designs.runs.map((one) => one.reduce((sum, run) => sum + run.wall, 0)), 3), texts("failed", designs.failed)];
}

class SearchPage {
  constructor(facts, bytes) {
    this.facts = facts;
    const designs = this.designs = new Designs(facts), id = (name) => document.getElementById(name);
    this.shades = new Shades(designs, facts.maps.viridis);
    this.file = facts.name.replace(/[^\w.-]+/g, "_");
    this.plots = [];
    const generation = { name: "generation", symbol: "generation", unit: "", whole: true };
    const chart = (place) => (one) => new Chart(place, one, facts.generations, () => {}, this.file, generation);
    facts.convergence.forEach(chart(id("convergence")));
    facts.progress.forEach(chart(id("progress")));
    if (!designs.count) return;
    this.histories(id("convergence"));
    if (facts.several) this.fronts(id("fronts"));
    this.colours(id("colours"));
    this.parallel = new Parallel(id("parallel"), { title: "Parallel coordinates", file: `${this.file}_parallel` }, this.quantities(), {
      colour: (k) => this.shades.colour(k), order: (k) => this.shades.worth(k) || 0, chosen: () => designs.chosen, choose: (k) => designs.choose(k),
      included: (k) => designs.included[k] && !designs.failed[k], describe: (k) => designs.describe(k), brushed: () => this.brushed() });
    this.pairChoice(id("pair-choice"));
    this.pairs(id("pairs"));
    this.table = new RowTable(id("rows"), designs.count, designColumns(designs, facts),
      { file: `${this.file}_designs`, label: "designs", by: 1, chosen: () => designs.chosen, choose: (k) => designs.choose(k) });
    const panel = new Panel(id("chosen"), facts, designs, this.table);
    this.clouds = facts.recordings.length ? new Clouds(id("views"), facts, bytes) : null;
    const bar = id("shown");
    designs.listeners.push((k) => {
      panel.show(k);
      this.table.markChosen();
      for (const plot of [...this.plots, ...this.pairPlots, this.parallel]) plot.markChosen();
      for (const place of [bar, id("told")]) place.textContent = designs.describe(k);
      this.clouds?.show(k, designs.named(k), (other) => designs.choose(other));
    });
    this.tell();
    designs.choose(Math.max(0, designs.best.indexOf(1)));
  }

  /** Choosing and reading, for all plots. */
  shared() {
    const { designs } = this;
    return { describe: (k) => designs.describe(k), chosen: () => designs.chosen, choose: (k) => designs.choose(k),
      columns: () => [["design", [...Array(designs.count).keys()].map((k) => k + 1)], ["generation", designs.gen], ["starts", designs.starts]] };
  }

  /** Each objective against the number of the design, and the best so far. */
  histories(place) {
    const { designs } = this, numbers = [...Array(designs.count).keys()].map((k) => k + 1);
    for (const one of designs.objectives) {
      const best = [], sign = one.largest ? -1 : 1;
      let least = Infinity;
      for (const k of numbers.keys()) {
        if (!designs.failed[k] && designs.feasible[k] !== "no" && sign * one.values[k] < least) {
          least = sign * one.values[k];
          best.push(k);
        }
      }
      this.plots.push(new Scatter(place, { title: `${one.name} of each design`, file: `${this.file}_${one.name}_designs`, height: 260 }, { ...this.shared(),
        x: numbers, y: one.values, xAxis: { label: "design, in the order of estimation" }, yAxis: this.designs.axis(one),
        style: (k) => (designs.failed[k] ? null : { radius: designs.rank[k] ? 4 : 2.2, fill: this.shades.colour(k), alpha: designs.included[k] ? 0.85 : 0.12 }),
        order: (k) => designs.rank[k] > 0, yBar: (k) => (designs.count <= FEW || designs.rank[k] || k === designs.chosen ? this.nearMean(one, k) : null),
        paths: (colours) => [{ points: best, stroke: colours.c0, dash: [4, 3] }] }));
    }
  }

  /** The standard error around the mean over the starts of the search. */
  nearMean(one, k) {
    return one.errors[k] > 0 ? [one.values[k] - one.errors[k], one.values[k] + one.errors[k]] : null;
  }

  fronts(place) {
    const { designs } = this, { objectives } = designs;
    for (let b = 1; b < objectives.length; b++) for (let a = 0; a < b; a++) {
      const [x, y] = [objectives[a], objectives[b]], way = (one) => (one.largest ? "more is better" : "less is better");
      const axis = (one) => ({ ...designs.axis(one), label: `${one.name}, ${way(one)}` });
      const starts = designs.starts.filter((_, k) => designs.rank[k]).sort((m, n) => m - n), enough = starts[Math.floor(starts.length / 2)] ?? 1;
      this.plots.push(new Scatter(place, { title: `${y.name} and ${x.name}`, file: `${this.file}_front_${x.name}_${y.name}`, height: 420 }, { ...this.shared(),
        x: x.reported, y: y.reported, xAxis: axis(x), yAxis: axis(y), order: (k) => designs.rank[k] > 0,
        xBar: (k) => (designs.rank[k] || k === designs.chosen ? designs.interval(x, k) : null), yBar: (k) => (designs.rank[k] || k === designs.chosen ? designs.interval(y, k) : null),
        style: (k, colours) => {
          if (designs.failed[k]) return null;
          const alpha = designs.included[k] ? 1 : 0.12, colour = colours?.c0;
          if (designs.rank[k]) return { radius: designs.best[k] ? 6 : 4, fill: designs.feasible[k] === "yes" || !designs.constraints.length ? colour : colours?.panel, stroke: colour, alpha };
          const few = designs.starts[k] < enough || designs.feasible[k] === "no";
          return { radius: 2.2, fill: few ? null : colours?.quiet, stroke: colours?.quiet, width: 0.8, alpha: 0.55 * alpha };
        } }));
    }
  }

  quantities() {
    const { designs } = this, sides = [...designs.constraints, ...designs.objectives];
    const ends = (one) => (one.choices || one.low === null ? {} : { ends: [one.low, one.high] });
    return [...designs.genes.filter((one) => one.varied).map((one) => ({ facts: { ...designs.axis(one), ...ends(one) }, values: one.places })),
      ...sides.map((one) => ({ facts: designs.axis(one), values: one.reported }))];
  }

  colours(place) {
    const { designs } = this, select = element("select", { onchange: () => {
      this.shades.by(designs.objectives[Number(select.value)]);
      this.parallel.order = null;
      this.pairs(document.getElementById("pairs"));
      this.repaint();
    } }, ...designs.objectives.map((one, k) => element("option", { value: k }, one.name)));
    this.legend = element("div");
    place.append(element("label", {}, element("span", {}, "Colour"), select), this.legend);
    this.legend.replaceChildren(this.shades.legend());
  }

  pairChoice(place) {
    const varied = this.designs.genes.filter((one) => one.varied);
    this.paired = new Set(varied.slice(0, FIRST_PAIRS));
    if (varied.length < 2) return;
    place.append(element("legend", {}, "Genes"), ...varied.map((one) => element("label", { class: "check" }, element("input", { type: "checkbox", checked: this.paired.has(one),
      onchange: (event) => { this.paired[event.target.checked ? "add" : "delete"](one); this.pairs(document.getElementById("pairs")); } }), one.name)));
  }

  /** A plot for each pair of the chosen genes, and of each with the value that gives the colours. */
  pairs(place) {
    const { designs, shades } = this, genes = designs.genes.filter((one) => this.paired.has(one));
    const all = [...genes.map((one) => ({ one, values: one.places })), { one: shades.one, values: shades.one.reported }];
    place.replaceChildren();
    this.pairPlots = [];
    place.style.setProperty("--pairs", Math.max(1, all.length - 1));
    for (let row = 1; row < all.length; row++) for (let column = 0; column < row; column++) {
      const cell = element("div");
      cell.style.gridArea = `${row} / ${column + 1}`;
      place.append(cell);
      const [x, y] = [all[column], all[row]];
      // Designs of one category would lie on one line.
      const spread = (k) => ((k * 0.6180339887) % 1 - 0.5) * 0.6;
      this.pairPlots.push(new Scatter(cell, { title: `${y.one.name} and ${x.one.name}`, file: `${this.file}_${x.one.name}_${y.one.name}`, height: 220, compact: true }, { ...this.shared(),
        x: x.values, y: y.values, xAxis: designs.axis(x.one), yAxis: designs.axis(y.one), order: (k) => shades.worth(k) || 0,
        shift: (k) => [x.one.choices ? spread(k) : 0, y.one.choices ? spread(k + 0.5) : 0],
        style: (k) => (designs.failed[k] ? null : { radius: 2.2, fill: shades.colour(k), alpha: designs.included[k] ? 0.85 : 0.06 }) }));
    }
  }

  brushed() {
    const { designs } = this, inside = [];
    for (let k = 0; k < designs.count; k++) {
      designs.included[k] = this.parallel.within(k);
      if (designs.included[k]) inside.push(k);
    }
    this.tell();
    this.parallel.repaint();
    // The table and the other plots follow when the pointer rests.
    clearTimeout(this.following);
    this.following = setTimeout(() => {
      this.table.filter(inside.length < designs.count ? inside : null);
      for (const plot of [...this.plots, ...this.pairPlots]) plot.repaint();
    }, 100);
  }

  tell() {
    const { designs } = this;
    this.parallel.tell(designs.included.reduce((sum, one) => sum + one, 0), designs.count);
  }

  repaint() {
    this.legend?.replaceChildren(this.shades.legend());
    for (const plot of [...this.plots, ...(this.pairPlots ?? []), this.parallel].filter(Boolean)) plot.repaint();
  }

  theme(dark) {
    this.repaint();
    this.clouds?.theme(dark);
  }
}

function startSearch() {
  tables();
  report.page = new SearchPage(json("facts"), fromBase64(document.getElementById("recording").textContent));
  themes((dark) => report.page.theme(dark));
  document.documentElement.dataset.ready = "yes";
}

startSearch();
