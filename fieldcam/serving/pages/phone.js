"use strict";

// The columns that the layouts are made for: upright, and lying on its side.
const COLUMNS = { upright: 48, lying: 100 };
const CELL_WIDTH_EM = 0.6;
const ASK_MS = 3000;

const upright = matchMedia("(orientation: portrait)");
const startTerminals = window.onload;

// textual.js starts what it finds in the page when that is loaded, with these settings.
window.onload = async (event) => {
  // A letter that is measured before its font is there has the wrong width.
  await document.fonts.load("16px 'Roboto Mono'");
  const terminal = document.querySelector(".textual-terminal");
  const columns = upright.matches ? COLUMNS.upright : COLUMNS.lying;
  terminal.dataset.fontSize = Math.floor((window.innerWidth / columns / CELL_WIDTH_EM) * 10) / 10;
  terminal.dataset.sessionWebsocketUrl = `${location.origin.replace(/^http/, "ws")}/ws`;
  startTerminals(event);
  for (const input of terminal.querySelectorAll("textarea")) {
    // A tap on a button must not open the keyboard.
    input.inputMode = "none";
  }
};
upright.addEventListener("change", () => location.reload());

// What is shown must not look like now when the laptop is out of reach.
async function ask() {
  let status = 0;
  try {
    status = (await fetch("/here", { signal: AbortSignal.timeout(ASK_MS) })).status;
  } catch {
    // No answer is status 0.
  }
  document.body.classList.toggle("-gone", status !== 204);
  const closed = document.body.classList.contains("-closed");
  if (status === 403 || (status === 204 && closed)) {
    location.reload();
    return;
  }
  setTimeout(ask, ASK_MS);
}
setTimeout(ask, ASK_MS);
