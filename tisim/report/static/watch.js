/* A run that is watched: new frames are added without losing the view. */

const MOST_BYTES = 4e8;         // decoded numbers in memory, above which all frames are read again, thinned

class LiveRun extends Live {
  /** Whether to read all frames again: at the end, with the counts of the run if it has a result, or to save memory. */
  get all() {
    return Boolean(this.leftOut) && (this.live.ended || report.trajectory.bytes > MOST_BYTES);
  }

  query() {
    return { key: this.live.key ?? "", after: this.all ? -1 : this.live.after ?? -1 };
  }

  async take(news) {
    const { live, all } = this;
    if (news.facts) {
      await this.add(news, all);
      this.leftOut = !all && (this.leftOut || news.shown < news.after - live.after);
      Object.assign(live, { after: news.after, all: news.all });
    }
    if (news.ended !== live.ended && news.ended && !all) this.leftOut = true;
    live.ended = news.ended;
    const some = report.trajectory.frames, count = live.all === 1 ? "one frame" : `${live.all} frames${some < live.all ? ` (${some} are shown)` : ""}`;
    if (news.ended) this.tell("ended", `The run has ended: ${count}.`);
    else this.tell("running", `Watching: ${count}, the last one ${this.ago(news.age)}.`);
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
    status.className = `status ${news.state}`;
    document.querySelector(".facts").textContent = news.summary;
    document.querySelector("footer p").textContent = all ? news.rounding : `Of the last frames: ${news.rounding}`;
    document.getElementById("notices").replaceChildren(...news.notices.map((text) => element("p", { class: `warning ${news.state}` }, text)));
  }
}

if (json("facts").live.waiting) beginLive(LiveRun);
else document.addEventListener("ready", () => beginLive(LiveRun), { once: true });
