/* The page of a run: decodes the recording, and connects the viewer, the curves and the tables. */

/** The page's data, with what the browser decoded, for tests and for the console. */
const report = {};

function json(id) {
  return JSON.parse(document.getElementById(id).textContent);
}

function tables() {
  for (const table of document.querySelectorAll("table[data-csv]")) {
    const save = () => {
      const rows = [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent.trim()));
      download(`${table.dataset.csv}.csv`, csv(rows), "text/csv");
    };
    table.parentNode.before(element("div", { class: "buttons after" }, element("button", { type: "button", onclick: save, "aria-label": `Save ${table.dataset.csv} as CSV` }, "CSV")));
  }
  const toml = document.getElementById("toml");
  if (!toml) return;
  const done = element("span", { class: "done", role: "status" });
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(toml.textContent);
    } catch {
      getSelection().selectAllChildren(toml);
      document.execCommand("copy");
    }
    done.textContent = "copied";
    setTimeout(() => { done.textContent = ""; }, 2000);
  };
  toml.before(element("div", { class: "buttons after" }, done, element("button", { type: "button", onclick: copy }, "Copy"),
    element("button", { type: "button", onclick: () => download("scene.toml", toml.textContent, "application/toml") }, "Save scene.toml")));
}

function themes(player) {
  const media = matchMedia("(prefers-color-scheme: dark)"), toggle = document.getElementById("theme");
  const apply = (dark) => {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    toggle.setAttribute("aria-pressed", dark);
    player?.theme(dark);
    for (const chart of report.charts ?? []) chart.mark();
  };
  toggle.addEventListener("click", () => apply(document.documentElement.dataset.theme !== "dark"));
  media.addEventListener("change", () => apply(media.matches));
  apply(media.matches);
}

async function decode(facts) {
  const bytes = fromBase64(document.getElementById("recording").textContent);
  let begin = 0;
  const parts = facts.lengths.map((length) => bytes.subarray(begin, begin += length));
  report.trajectory = await Trajectory.decode(facts.trajectory, parts);
  report.network = facts.network ? await ContactNetwork.decode(facts.network, parts.at(-1)) : null;
}

async function start() {
  const facts = json("facts"), place = document.getElementById("viewer");
  tables();
  try {
    await decode(facts);
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
  report.player?.listeners.push((frame) => { for (const chart of report.charts) chart.at(report.trajectory.times[frame]); });
  themes(report.player);
  report.player?.go(0);
  document.documentElement.dataset.ready = "yes";
}

window.report = report;
start();
