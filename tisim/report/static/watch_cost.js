/* A study of costs that is watched. */

class LiveStudy extends LiveRemade {
  get things() {
    return `${this.live.settings} settings`;
  }

  get subject() {
    return "study";
  }

  /** A name by which a setting is found again. */
  name(row) {
    return JSON.stringify([row.method, row.setting, row.precision, row.arithmetic, row.python]);
  }

  kept() {
    const { rows, choice, hidden } = report.page;
    return { chosen: rows.length ? this.name(rows[choice.chosen]) : null, hidden: [...hidden] };
  }

  restore(kept) {
    const { rows, choice } = report.page;
    for (const box of document.querySelectorAll("#methods input")) {
      if (kept.hidden.includes(box.parentNode.textContent)) box.click();
    }
    const at = rows.findIndex((row) => this.name(row) === kept.chosen);
    if (at >= 0) choice.choose(at);
  }
}

beginLive(LiveStudy);
