/* All pages: their data, saved tables, and light and dark colours. */

/** The page's data, with what the browser decoded, for tests and for the console. */
const report = {};

function json(id) {
  return JSON.parse(document.getElementById(id).textContent);
}

function tables(place = document) {
  for (const table of place.querySelectorAll("table[data-csv]")) {
    const save = () => {
      const rows = [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent.trim()));
      download(`${table.dataset.csv}.csv`, csv(rows), "text/csv");
    };
    table.parentNode.before(element("div", { class: "buttons after" }, element("button", { type: "button", onclick: save, "aria-label": `Save ${table.dataset.csv} as CSV` }, "CSV")));
  }
  for (const text of place.querySelectorAll("pre[data-file]")) text.before(copying(text, text.dataset.file));
}

/** Buttons that copy the text of an element, and save it as a file. */
function copying(place, fileName) {
  const done = element("span", { class: "done", role: "status" });
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(place.textContent);
    } catch {
      getSelection().selectAllChildren(place);
      document.execCommand("copy");
    }
    done.textContent = "copied";
    setTimeout(() => { done.textContent = ""; }, 2000);
  };
  return element("div", { class: "buttons after" }, done, element("button", { type: "button", onclick: copy, "aria-label": `Copy ${fileName}` }, "Copy"),
    element("button", { type: "button", onclick: () => download(fileName, place.textContent, "text/plain") }, `Save ${fileName}`));
}

/** paint : called with whether the colours are dark, at first and at each change. */
function themes(paint) {
  const media = matchMedia("(prefers-color-scheme: dark)"), toggle = document.getElementById("theme");
  const apply = (dark) => {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    toggle.setAttribute("aria-pressed", dark);
    paint(dark);
  };
  toggle.addEventListener("click", () => apply(document.documentElement.dataset.theme !== "dark"));
  media.addEventListener("change", () => apply(media.matches));
  apply(media.matches);
}

window.report = report;
