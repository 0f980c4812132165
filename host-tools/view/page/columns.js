// SPDX-License-Identifier: MIT
// Values over time, as /api/recent and /api/history send them: one column each, as long as `unix_s`.

const OF_A_CHANNEL = ["demand_um", "output_um", "applied_um", "limit_um"];
const GAP_S = 5; // a longer silence interrupts the curves
export const RECENT_S = 600;

const asMap = object => new Map(Object.entries(object ?? {}));

/** in : the server's document, or nothing. out: columns of one length, with maps from name to column. */
export function columnsOf(from = {}) {
  const columns = {
    unix_s: from.unix_s ?? [],
    mode: from.mode ?? [],
    channels: asMap(from.channels),
    signals: asMap(from.signals),
  };
  for (const channel of columns.channels.values()) for (const key of OF_A_CHANNEL) channel[key] ??= [];
  fill(columns);
  return columns;
}

/** The column of this name; a new one is empty up to now. */
function column(map, name, length) {
  if (!map.has(name)) map.set(name, new Array(length).fill(null));
  return map.get(name);
}

function channelColumns(columns, name) {
  if (!columns.channels.has(name)) {
    const empty = () => new Array(columns.unix_s.length).fill(null);
    columns.channels.set(name, Object.fromEntries(OF_A_CHANNEL.map(key => [key, empty()])));
  }
  return columns.channels.get(name);
}

/** All columns but unix_s and mode. */
function* values(columns) {
  for (const channel of columns.channels.values()) yield* OF_A_CHANNEL.map(key => channel[key]);
  yield* columns.signals.values();
}

function fill(columns) {
  const length = columns.unix_s.length;
  for (const one of values(columns)) while (one.length < length) one.push(null);
}

function drop(columns, count) {
  columns.unix_s.splice(0, count);
  columns.mode.splice(0, count);
  for (const one of values(columns)) one.splice(0, count);
}

/**
 * Appends a snapshot that is newer than the last one, and forgets what is older than ten minutes. A wall clock that was
 * set back begins anew.
 */
export function append(columns, snapshot) {
  if (columns.unix_s.at(-1) - snapshot.unix_s > GAP_S) drop(columns, columns.unix_s.length);
  const last_s = columns.unix_s.at(-1) ?? -Infinity;
  if (!(snapshot.unix_s > last_s)) return;
  if (snapshot.unix_s - last_s > GAP_S && columns.unix_s.length > 0) {
    columns.unix_s.push(last_s + 0.001);
    columns.mode.push(null);
    fill(columns);
  }
  const before = columns.unix_s.length;
  for (const channel of snapshot.channels) {
    const to = channelColumns(columns, channel.name);
    for (const key of OF_A_CHANNEL) to[key].push(channel[key]);
  }
  for (const signal of snapshot.signals) column(columns.signals, signal.name, before).push(signal.value);
  columns.unix_s.push(snapshot.unix_s);
  columns.mode.push(snapshot.mode);
  fill(columns);
  const old = columns.unix_s.findIndex(unix_s => unix_s >= snapshot.unix_s - RECENT_S);
  if (old > 100) drop(columns, old);
}
