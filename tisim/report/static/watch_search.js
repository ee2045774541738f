/* A search that is watched: the page is read again when there are new designs, and shows the same part of it. */

const REST = 2000;             // time without a key, a click or a movement before the page is read again, ms
const KEPT = "tisim watch";

class LiveSearch extends Live {
  constructor(live) {
    super(live);
    this.used = 0;
    for (const kind of ["pointermove", "pointerdown", "keydown", "wheel", "input"]) addEventListener(kind, () => { this.used = performance.now(); }, { passive: true });
    this.restore();
  }

  query() {
    return { version: this.live.version ?? "" };
  }

  take(news) {
    const count = `${this.live.designs} designs`;
    if (news.changed && performance.now() > this.used + REST) {
      this.keep();
      return location.reload();
    }
    if (news.changed) this.tell("running", `Watching: ${count}. There are new ones, which are read when this page rests.`);
    else if (news.ended) this.tell("ended", `The search has ended: ${count}.`);
    else this.tell("running", `Watching: ${count}; its files changed ${this.ago(news.age)}.`);
  }

  /** The genes of a design, by which it is found again. */
  genes(k) {
    const { genes } = report.page.designs;
    return JSON.stringify(genes.map((one) => one.values[k]));
  }

  keep() {
    const { page } = report, { designs } = page;
    const brushes = page.parallel?.axes.map((one) => one.brush) ?? [], dark = document.documentElement.dataset.theme;
    sessionStorage.setItem(KEPT, JSON.stringify({
      scroll: scrollY, chosen: designs.chosen < 0 ? null : this.genes(designs.chosen), dark, brushes,
      colour: designs.objectives.indexOf(page.shades.one), paired: [...(page.paired ?? [])].map((one) => one.name),
    }));
  }

  restore() {
    const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "null"), { page } = report;
    sessionStorage.removeItem(KEPT);
    if (!kept || !page?.designs.count) return;
    const { designs } = page;
    if (document.documentElement.dataset.theme !== kept.dark) document.getElementById("theme").click();
    const select = document.querySelector("#colours select");
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
    scrollTo({ top: kept.scroll, behavior: "instant" });
  }
}

beginLive(LiveSearch);
