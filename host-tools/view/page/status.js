// SPDX-License-Identifier: MIT
// The head of the page: the mode and why, or that there is no news.

import { byId, show } from "./element.js";
import { modeSince } from "./events.js";
import { clock, duration } from "./format.js";

const MEANINGS = new Map([
  ["STANDBY", "The box writes zero."],
  ["ACTIVE", "The box compensates."],
  ["HOLD", "The outputs stay where they are."],
  ["RAMP", "The outputs go to zero."],
  ["FAULT", "The outputs go to zero and stay there until the PLC's reset."],
  ["STOPPED", "The box has stopped. Its outputs are zero."],
]);

const sentence = text => text.charAt(0).toUpperCase() + text.slice(1);

/** out: ", since 12:03:11" where the events know it */
function sinceOf(snapshot) {
  const since_s = modeSince(snapshot.mode);
  if (since_s === null) return "";
  const ago_s = snapshot.unix_s - since_s;
  return ago_s < 86400 ? `, since ${clock(since_s)}` : `, for ${duration(ago_s)}`;
}

const news = age => `no news for ${duration(age)}.`;

/** in : live. out: the mode for the colour, the text in large letters, and up to three sentences. */
function words(live) {
  const { state } = live, snapshot = state?.snapshot;
  const last = snapshot ? `The last mode was ${snapshot.mode}: ${snapshot.reason}.` : "";
  const grey = (large, meaning, more) => ({ mode: "none", large, meaning, more });
  if (live.away) return grey("NO CONNECTION", `compbox-view does not reply: ${news(live.age_s())}`, last);
  if (!state) return grey("…", "Waiting for compbox-view.", "");
  if (!snapshot) return grey("NO NEWS", "There is no snapshot of the box.", state.why ?? "");
  const { mode } = snapshot;
  if (snapshot.finished) {
    const meaning = `compboxd ended ${duration(live.age_s())} ago.`;
    return { mode, large: mode, meaning, more: sentence(snapshot.reason) };
  }
  if (state.stale) return grey("NO NEWS", `The box does not write: ${news(live.age_s())}`, last);
  const more = `${sentence(snapshot.reason)}${sinceOf(snapshot)}`;
  return { mode, large: mode, meaning: MEANINGS.get(mode) ?? "", more, cause: snapshot.cause?.text };
}

/** Shows the mode, and whether the values below are old. */
export function showStatus(live) {
  const { mode, large, meaning, more, cause } = words(live);
  const snapshot = live.state?.snapshot;
  byId("status").dataset.mode = mode;
  show(byId("mode"), large);
  show(byId("meaning"), meaning);
  show(byId("reason"), more);
  show(byId("cause"), cause ? `Cause: ${cause}` : "");
  document.body.classList.toggle("old", mode === "none" || Boolean(snapshot?.finished));
  const name = snapshot?.machine ?? "compbox";
  show(byId("machine"), name);
  const title = `${large} – ${name}`;
  if (document.title !== title) document.title = title;
  show(byId("news"), snapshot ? `${live.age_s().toFixed(1)} s old` : "");
}
