// SPDX-License-Identifier: MIT
// The events, newest first, and the coefficient files that they name.

import { byId, element, show } from "./element.js";
import { dayAndClock } from "./format.js";

const MOST = 200;
const FROM_THE_LOG = new Set(["run", "mode", "link", "wire", "can", "bus", "file", "commission"]);

let events = []; // in the order of the file: the clock may have been set back

function itemOf(event) {
  const sure = event.synchronised !== false;
  const time = element("time", { class: "numbers" }, dayAndClock(event.unix_s));
  const kind = FROM_THE_LOG.has(event.kind) ? event.kind : "other";
  const item = element("li", { "data-kind": kind, "data-mode": event.mode ?? "" }, time,
    element("span", { class: "kind" }, event.kind ?? ""), element("span", { class: "text" }, event.text ?? ""));
  if (!sure) time.prepend(element("abbr", { title: "the wall clock was not synchronised" }, "≈"));
  const lost = event.lost_before;
  if (lost) item.append(element("span", { class: "lost" }, `${lost} events before this one are missing`));
  return item;
}

export function setEvents(list) {
  events = list.slice(-MOST);
  byId("event-list").replaceChildren(...events.map(itemOf).reverse());
}

export function addEvent(event) {
  const known = other => other.boot === event.boot && other.boot_s === event.boot_s && other.text === event.text;
  if (events.some(known)) return;
  events.push(event);
  byId("event-list").prepend(itemOf(event));
  while (events.length > MOST) {
    events.shift();
    byId("event-list").lastElementChild.remove();
  }
}

/** out: hash and user of the file with this CRC, as far as the events know them, or "". */
function originOf(crc) {
  const file = events.findLast(event => event.file?.crc === crc)?.file;
  if (!file) return "";
  const sender = file.requested_by ? `, requested by user ${file.requested_by.user}` : "";
  return `SHA-256 ${String(file.sha256).slice(0, 12)}…, owned by user ${file.owner}${sender}`;
}

function fileRow(title, file, since) {
  const notes = [since, file ? originOf(file.crc) : ""].filter(text => text);
  return [element("dt", {}, title), element("dd", { class: "numbers" },
    file ? `revision ${file.revision}, CRC ${file.crc}` : "none in these events",
    ...notes.map(text => element("small", {}, text)))];
}

/** Shows the file that runs and the one before it, as far as the events go back. */
export function showFiles(snapshot) {
  const ran = event => event.crc && event.kind !== "commission"; // that one has the file of another program
  const before = events.findLastIndex(event => ran(event) && event.crc !== snapshot.crc);
  const first = events[before + 1];
  const key = JSON.stringify([snapshot.crc, snapshot.revision, first?.unix_s, events[before]?.crc,
    originOf(snapshot.crc)]);
  const since = first?.crc === snapshot.crc ? `since ${dayAndClock(first.unix_s)}` : "";
  const list = byId("file-list");
  if (list.dataset.shown === key) return;
  list.dataset.shown = key;
  list.replaceChildren(
    ...fileRow("runs now", snapshot, since && before < 0 ? `${since} or before` : since),
    ...fileRow("the one before", events[before], events[before] ? `until ${dayAndClock(events[before].unix_s)}` : ""));
}

/** The mode's event is the newest of the kind; out: when the mode began, s, or null. */
export function modeSince(mode) {
  const last = events.findLast(event => event.kind === "mode");
  return last?.mode === mode ? last.unix_s : null;
}
