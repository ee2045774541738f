/* The page of a run: decodes the recording, and connects the viewer, the curves and the tables. */

async function start() {
  const facts = json("facts"), place = document.getElementById("viewer");
  tables();
  try {
    const run = await decodeRun(facts, fromBase64(document.getElementById("recording").textContent));
    Object.assign(report, run, facts.live ? { trajectory: new JoinedTrajectory(run, facts.scene) } : {});
    report.player = new Player(place, report.trajectory, facts.scene, report.network, facts);
  } catch (error) {
    place.replaceChildren(element("p", { class: "warning", role: "alert" }, `The particles cannot be shown: ${error.message}`));
  }
  place.classList.remove("waiting");
  const jump = (time) => {
    if (!report.player) return;
    report.player.play(false);
    const times = report.trajectory.times;
    report.player.go(times.reduce((best, t, k) => (Math.abs(t - time) < Math.abs(times[best] - time) ? k : best), 0));
  };
  const curves = document.getElementById("curves"), name = facts.name.replace(/[^\w.-]+/g, "_");
  report.charts = facts.series.curves.map((one) => new Chart(curves, one, facts.series.times, jump, name));
  const omega = { name: "angular frequency", symbol: "\u03c9", unit: "1/s", whole: false }, below = document.getElementById("spectra");
  report.spectra = (facts.spectra ?? []).map((one) => new Chart(below, one, one.omega, () => {}, name, omega));
  // Their highest lines are read out at first.
  for (const one of report.spectra) one.at(one.times[one.facts.curves[0].values.reduce((best, y, k, all) => (y > all[best] ? k : best), 0)]);
  report.player?.listeners.push((frame) => { for (const chart of report.charts) chart.at(report.trajectory.times[frame]); });
  themes((dark) => report.player?.theme(dark));
  report.player?.go(facts.live ? report.trajectory.frames - 1 : 0);
  document.documentElement.dataset.ready = "yes";
  document.dispatchEvent(new Event("ready"));
}

start();
