/* A page that is watched: asks its server for news, and shows the state in a line below its heading. */

class Live {
  /** live : of the facts of the page. What the news changes is in subclasses: ``query()`` and ``take(news)``. */
  constructor(live) {
    Object.assign(this, { live, state: "" });
    this.line = element("p", { class: "live" });
    this.told = element("div", { class: "unseen", role: "status" });
    document.querySelector("header").after(this.line, this.told);
    this.ask();
  }

  /** Asks again after a while; a page that is not visible waits until it is. */
  later(seconds) {
    setTimeout(() => {
      if (document.hidden) document.addEventListener("visibilitychange", () => this.ask(), { once: true });
      else this.ask();
    }, 1000 * seconds);
  }

  /** Shows the state in a sentence; a new state is announced to those who do not see it. */
  tell(state, sentence) {
    this.line.textContent = sentence;
    document.documentElement.dataset.live = state;
    if (state !== this.state) this.told.textContent = sentence;
    this.state = state;
  }

  async ask() {
    const { live } = this;
    let seconds = live.poll;
    try {
      const answer = await fetch(`news?${new URLSearchParams(this.query())}`, { credentials: "omit" });
      if (!answer.ok) throw new Error(`answer ${answer.status}`);
      const news = await answer.json();
      if (news.reload || (live.waiting && !news.waiting && !news.problem)) return location.reload();
      if (news.problem) this.tell("problem", `The files cannot be read at this moment; this is their last good state. Trying again. (${news.problem})`);
      else if (news.waiting) this.tell("waiting", "There is nothing to show yet. Looking again.");
      else await this.take(news);
    } catch (error) {
      this.tell("gone", `The server of this page does not answer (${error.message}). The page keeps the last state.`);
      seconds = 5;
    }
    this.later(seconds);
  }

  query() {
    return {};
  }

  ago(seconds) {
    return seconds < 2 ? "just now" : seconds < 120 ? `${Math.round(seconds)} s ago` : `${Math.round(seconds / 60)} min ago`;
  }
}

/** Begins when the page is ready; a page that waits for its files has nothing else. */
function beginLive(kind) {
  const { live } = json("facts");
  if (live.waiting) themes(() => {});
  report.watch = new kind(live);
  document.documentElement.dataset.ready = "yes";
}
