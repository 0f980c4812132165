// SPDX-License-Identifier: MIT
// Times of the loop, counters, and the nodes of CAN and the bus. Filled only while it is open.

import { byId, element } from "./element.js";
import { dayAndClock, number, whole } from "./format.js";

const words = key => key.replaceAll("_", " ");

/** head: its columns, the first of which is named by the rows; without it the table has no head. */
function tableOf(caption, head, rows) {
  const columns = head.map(text => (text ? element("th", { scope: "col" }, text) : element("td")));
  return element("table", {}, element("caption", {}, caption),
    ...(head.length > 0 ? [element("thead", {}, element("tr", {}, ...columns))] : []),
    element("tbody", {}, ...rows.map(([name, ...values]) => element("tr", {}, element("th", { scope: "row" }, name),
      ...values.map(value => element("td", { class: "numbers" }, value))))));
}

const asText = value => (typeof value === "number" ? whole(value) : String(value));

/** A table of what is a number or a text, and one of each list of objects. */
function tablesOf(caption, object) {
  const plain = Object.entries(object).filter(([, value]) => typeof value !== "object");
  const lists = Object.entries(object).filter(([, value]) => Array.isArray(value) && value.length > 0);
  return [tableOf(caption, [], plain.map(([key, value]) => [words(key), asText(value)])),
    ...lists.map(([key, list]) => tableOf(`${caption}: ${words(key)}`, Object.keys(list[0]).map(words),
      list.map(one => Object.values(one).map(asText))))];
}

function aboutOf(snapshot) {
  return tableOf("Box", [], [
    ["compboxd", snapshot.version], ["PLC", snapshot.plc], ["started", dayAndClock(snapshot.started_unix_s)],
    ["period", `${number(snapshot.period_us / 1000, 1)} ms`],
    ["lead of positions", `${number(snapshot.lead_us / 1000, 1)} ms`],
  ]);
}

function timesOf(snapshot) {
  const row = (name, times) => [name, ...["p50", "p99", "max"].map(key => `${number(times[key], 0)} µs`)];
  return tableOf("Times", ["", "half below", "99 % below", "longest"],
    [row("lateness of wake-ups", snapshot.jitter_us), row("exchange with the PLC", snapshot.exchange_us)]);
}

/** Shows the snapshot's details if they are open. */
export function showDetails(snapshot) {
  if (!byId("details").open) return;
  const { counters, can, bus } = snapshot;
  byId("detail-list").replaceChildren(aboutOf(snapshot), timesOf(snapshot), ...tablesOf("Counters", counters),
    ...(can ? tablesOf("CAN", can) : []), ...(bus ? tablesOf("Sensor bus", bus) : []));
}
