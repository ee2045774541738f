/* A search that is watched. */

class LiveSearch extends LiveRemade {
  get things() {
    return `${this.live.designs} designs`;
  }

  get subject() {
    return "search";
  }

  /** The genes of a design, by which it is found again. */
  genes(k) {
    const { genes } = report.page.designs;
    return JSON.stringify(genes.map((one) => one.values[k]));
  }

  kept() {
    const { page } = report, { designs } = page;
    return {
      chosen: designs.chosen < 0 ? null : this.genes(designs.chosen), brushes: page.parallel?.axes.map((one) => one.brush) ?? [],
      colour: designs.objectives.indexOf(page.shades.one), paired: [...(page.paired ?? [])].map((one) => one.name),
    };
  }

  restore(kept) {
    const { page } = report;
    if (!page?.designs.count) return;
    const { designs } = page, select = document.querySelector("#colours select");
    if (select && kept.colour > 0) {
      select.value = kept.colour;
      select.dispatchEvent(new Event("change"));
    }
    for (const box of document.querySelectorAll("#pair-choice input")) {
      if (box.checked !== kept.paired.includes(box.parentNode.textContent)) box.click();
    }
    kept.brushes.forEach((brush, at) => { if (brush && page.parallel.axes[at]) page.parallel.brush(at, brush); });
    for (let k = 0; k < designs.count; k++) {
      if (this.genes(k) === kept.chosen) designs.choose(k);
    }
  }
}

beginLive(LiveSearch);
