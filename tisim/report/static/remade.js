/* A page that is watched and made again by its server: it is read again when it has changed, and shows the same part. */

const REST = 2000;             // time without a key, a click or a movement before the page is read again, ms
const KEPT = "tisim watch";

class LiveRemade extends Live {
  /** Subclasses have ``things``, what there is so far, ``subject``, and ``kept`` and ``restore`` for the reader's choices. */
  constructor(live) {
    super(live);
    this.used = 0;
    for (const kind of ["pointermove", "pointerdown", "keydown", "wheel", "input"]) addEventListener(kind, () => { this.used = performance.now(); }, { passive: true });
    const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
    sessionStorage.removeItem(KEPT);
    if (!kept || live.waiting) return;
    if (document.documentElement.dataset.theme !== kept.dark) document.getElementById("theme").click();
    this.restore(kept);
    scrollTo({ top: kept.scroll, behavior: "instant" });
  }

  query() {
    return { version: this.live.version ?? "" };
  }

  take(news) {
    if (news.changed && performance.now() > this.used + REST) {
      sessionStorage.setItem(KEPT, JSON.stringify({ scroll: scrollY, dark: document.documentElement.dataset.theme, ...this.kept() }));
      return location.reload();
    }
    if (news.changed) this.tell("running", `Watching: ${this.things}. There are new ones, which are read when this page rests.`);
    else if (news.ended) this.tell("ended", `The ${this.subject} has ended: ${this.things}.`);
    else this.tell("running", `Watching: ${this.things}; its files changed ${this.ago(news.age)}.`);
  }
}
