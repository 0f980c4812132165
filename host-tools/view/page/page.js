// SPDX-License-Identifier: MIT
// Ties the parts together: the state in, numbers at once, curves once a second.

import { showChannels } from "./channels.js";
import { append, columnsOf, RECENT_S } from "./columns.js";
import { showDetails } from "./details.js";
import { byId, show } from "./element.js";
import { addEvent, setEvents, showFiles } from "./events.js";
import { get, Live } from "./live.js";
import { showSignals } from "./signals.js";
import { showStatus } from "./status.js";
import { followTheme, remember, remembered } from "./theme.js";

const HOURS = { day: 24, month: 720 };
const NO_RECORD = "There is no record of this time: start compboxd and compbox-view with --record.";
const DRAW_MS = 1000, PAST_AGAIN_MS = 60000, EVENTS = 200;

let recent = columnsOf();
let history = { span: "", columns: columnsOf() };
let cards = [];
let pastMissing = true;

const chosen = name => document.querySelector(`input[name=${name}]:checked`).value;

/** After each connection: what happened while there was none. */
async function fetchPast() {
  try {
    const [past, events] = await Promise.all([get("api/recent"), get(`api/events?limit=${EVENTS}`)]);
    recent = columnsOf(past);
    setEvents(events);
    pastMissing = false;
  } catch {
    pastMissing = true; // asked for again within a minute, or by the next connection
  }
  fetchHistory();
}

async function fetchHistory() {
  const span = chosen("span");
  if (!(span in HOURS)) {
    show(byId("history"), "");
    return;
  }
  try {
    const columns = columnsOf(await get(`api/history?hours=${HOURS[span]}`));
    if (chosen("span") !== span) return;
    history = { span, columns };
    show(byId("history"), columns.unix_s.length > 0 ? "" : NO_RECORD);
  } catch {
    show(byId("history"), NO_RECORD);
  }
  draw();
}

/** out: the columns of the chosen span, and the range of times to show. */
function chosenColumns(now_s) {
  const span = chosen("span");
  if (!(span in HOURS)) return [recent, [now_s - RECENT_S, now_s]];
  return [history.span === span ? history.columns : columnsOf(), [now_s - 3600 * HOURS[span], now_s]];
}

function draw() {
  const now_s = live.state?.snapshot?.unix_s;
  if (now_s === undefined || document.hidden) return;
  const [columns, range_s] = chosenColumns(now_s);
  const view = { range_s, modes: columns.mode, limitsShown: chosen("height") === "limits" };
  for (const card of cards) card.draw(columns, view);
  showDetails(live.state.snapshot);
}

function showState({ snapshot }) {
  showStatus(live);
  if (!snapshot) return;
  append(recent, snapshot);
  const before = cards;
  cards = [...showChannels(snapshot), ...showSignals(snapshot)];
  showFiles(snapshot);
  if (cards.length !== before.length) draw();
}

function keepChoice(name, changed) {
  for (const input of document.querySelectorAll(`input[name=${name}]`)) {
    input.checked = input.value === remembered(name, document.querySelector(`input[name=${name}]:checked`)?.value);
    input.addEventListener("change", () => {
      remember(name, input.value);
      changed();
    });
  }
}

const live = new Live({ opened: fetchPast, live: showState, event: addEvent });
keepChoice("span", () => {
  fetchHistory();
  draw();
});
keepChoice("height", draw);
followTheme(() => {
  for (const card of cards) card.chart.recolour();
  draw();
});
byId("details").addEventListener("toggle", draw);
document.addEventListener("visibilitychange", draw);
setInterval(() => showStatus(live), 250);
setInterval(draw, DRAW_MS);
setInterval(() => (pastMissing ? fetchPast() : fetchHistory()), PAST_AGAIN_MS);
