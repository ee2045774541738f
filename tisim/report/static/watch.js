/* A page that is watched: asks its server for new frames, and adds them without losing the view. */

const MOST_BYTES = 4e8;         // decoded numbers in memory, above which all frames are read again, thinned

class Watch {
  constructor(live) {
    Object.assign(this, { live, leftOut: false, state: "" });
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
    const { live } = this, all = this.leftOut && (live.ended || this.full());
    let seconds = live.poll;
    try {
      const answer = await fetch(`news?key=${live.key ?? ""}&after=${all ? -1 : live.after ?? -1}`, { credentials: "omit" });
      if (!answer.ok) throw new Error(`answer ${answer.status}`);
      const news = await answer.json();
      if (news.reload || (live.waiting && !news.waiting && !news.problem)) return location.reload();
      if (news.problem) this.tell("problem", `The run cannot be read at this moment; this is its last good state. Trying again. (${news.problem})`);
      else if (news.waiting) this.tell("waiting", "There is no frame yet. Looking again.");
      else await this.take(news, all);
    } catch (error) {
      this.tell("gone", `The server of this page does not answer (${error.message}). The page keeps the last state.`);
      seconds = 5;
    }
    document.documentElement.dataset.asked = Number(document.documentElement.dataset.asked ?? 0) + 1;
    this.later(seconds);
  }

  full() {
    return report.trajectory?.bytes > MOST_BYTES;
  }

  async take(news, all) {
    const { live } = this;
    if (news.facts) {
      await this.add(news, all);
      this.leftOut = !all && (this.leftOut || news.shown < news.after - live.after);
      live.after = news.after;
      live.all = news.all;
    }
    // At the end, all frames and the counts of the run are read once more.
    if (news.ended && !live.ended && !all) this.leftOut = true;
    live.ended = news.ended;
    const count = `${live.all} frames`;
    if (news.ended) this.tell("ended", `The run has ended. ${count}.`);
    else this.tell("running", `Watching: ${count}, the last one ${this.ago(news.age)}.`);
  }

  ago(seconds) {
    return seconds < 2 ? "just now" : seconds < 120 ? `${Math.round(seconds)} s ago` : `${Math.round(seconds / 60)} min ago`;
  }

  async add(news, all) {
    const { facts } = news, run = await decodeRun(facts, fromBase64(news.recording));
    const { trajectory, player, charts } = report;
    if (all) trajectory.replace(run, facts.scene);
    else if (!trajectory.add(run, facts.scene)) return location.reload();
    player?.extend(facts.scene);
    for (const chart of charts) {
      const own = facts.series.curves.find((one) => one.title === chart.facts.title);
      chart.extend(facts.series.times, own?.curves ?? [], all);
    }
    const place = document.getElementById("numbers"), status = document.querySelector(".status");
    place.innerHTML = news.numbers;
    tables(place);
    status.textContent = news.verdict;
    status.className = `status ${news.verdict === "failed" ? "failed" : news.ended ? "ok" : "unfinished"}`;
    document.querySelector(".facts").textContent = news.summary;
    document.getElementById("notices").replaceChildren(...news.notices.map((text) => element("p", { class: `warning ${news.verdict}` }, text)));
  }
}

function watch() {
  const { live } = json("facts");
  if (live.waiting) themes(() => {});
  report.watch = new Watch(live);
  document.documentElement.dataset.ready = "yes";
}

if (json("facts").live.waiting) watch();
else document.addEventListener("ready", watch, { once: true });
