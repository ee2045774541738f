/* Plays the recording of a case in place of its still picture. The viewer and the recording are scripts that are
   loaded when a reader asks for them, which a page that was opened as a file may do too. */

(() => {
  "use strict";
  const here = new URL("./", document.currentScript.src), loaded = {}, recordings = {};
  const PLAYING = "playing";

  /** Called by the script of a recording. */
  window.tisimRecording = (name, facts, data) => { recordings[name] = { facts, data }; };

  function load(address) {
    loaded[address] ??= new Promise((done, failed) => {
      const script = document.createElement("script");
      script.src = new URL(address, here);
      script.onload = done;
      script.onerror = () => {
        delete loaded[address];
        failed(new Error(`${address} could not be loaded`));
      };
      document.head.append(script);
    });
    return loaded[address];
  }

  const media = matchMedia("(prefers-color-scheme: dark)");
  let close = null, theme = null;

  function dark() {
    const chosen = document.body.dataset.theme;
    return chosen === "dark" || (chosen !== "light" && media.matches);
  }

  /** Sets up a figure, which has a still picture and a button over it. */
  function prepare(figure) {
    const name = figure.dataset.recording, [button] = figure.getElementsByTagName("button");
    const screen = button.parentNode, said = document.createElement("p");
    said.className = "said";
    said.setAttribute("role", "status");
    screen.after(said);
    const stop = document.createElement("button");
    stop.type = "button";
    stop.className = "stop";
    stop.textContent = "Close the recording";
    const place = document.createElement("div");
    button.hidden = false;
    button.addEventListener("click", async () => {
      button.disabled = true;
      said.textContent = "Loading the recording";
      try {
        await Promise.all([load("viewer.js"), load(`recordings/${name}.js`)]);
        close?.();
        const { facts, data } = recordings[name], host = document.createElement("div");
        place.replaceChildren(host, stop);
        screen.hidden = true;
        screen.after(place);
        figure.classList.add(PLAYING);
        close = () => {
          player?.play(false);
          place.remove();
          figure.classList.remove(PLAYING);
          screen.hidden = false;
          close = theme = null;
        };
        let player = null;
        player = await tisimViewer.show(host, facts, data);
        theme = () => {
          host.dataset.theme = dark() ? "dark" : "light";
          player.theme(dark());
        };
        theme();
        figure.player = player;
        player.canvas.focus({ preventScroll: true });
        figure.scrollIntoView({ block: "nearest" });
        player.play(true);
        said.textContent = "";
      } catch (error) {
        close?.();
        said.textContent = `The recording cannot be shown: ${error.message}`;
      }
      button.disabled = false;
    });
    stop.addEventListener("click", () => {
      close();
      button.focus();
    });
  }

  function begin() {
    for (const figure of document.querySelectorAll("figure[data-recording]")) prepare(figure);
    media.addEventListener("change", () => theme?.());
    new MutationObserver(() => theme?.()).observe(document.body, { attributeFilter: ["data-theme"] });
  }

  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
  else begin();
})();
