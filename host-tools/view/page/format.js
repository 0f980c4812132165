// SPDX-License-Identifier: MIT
// Values to text. All text enters the page as textContent, so a name from a file is never markup.

const NOTHING = "–";

/** in : value, a number or null. out: with this many decimals and a true minus sign; never "−0.0". */
export function number(value, decimals) {
  if (typeof value !== "number" || !Number.isFinite(value)) return NOTHING;
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** out: "−13.5 µm"; a dash without a value */
export const micrometres = value => (Number.isFinite(value) ? `${number(value, 1)} µm` : NOTHING);

const UNITS = new Map([["degC", "°C"], ["um", "µm"], ["urad", "µrad"], ["deg", "°"]]);

export const unitWord = unit => UNITS.get(unit) ?? unit;

const DECIMALS = new Map([["mm", 3], ["degC", 2], ["1/min", 0], ["%", 1], ["mm/min", 0]]);

/** A signal's value without its unit, with the decimals usual for the unit. */
export const signalNumber = (value, unit) => number(value, DECIMALS.get(unit) ?? 2);

export const whole = value =>
  typeof value === "number" ? value.toLocaleString("en").replaceAll(",", "\u202f") : NOTHING;

/** in : seconds. out: its two largest units: "12 s", "4 min 30 s", "2 h 5 min", "3 d 4 h". */
export function duration(seconds) {
  const s = Math.max(0, Math.floor(seconds));
  if (s < 60) return `${s} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min ${s % 60} s`;
  if (s < 86400) return `${Math.floor(s / 3600)} h ${Math.floor(s / 60) % 60} min`;
  return `${Math.floor(s / 86400)} d ${Math.floor(s / 3600) % 24} h`;
}

const two = value => String(value).padStart(2, "0");

/** in : wall clock, s. out: "12:03:11" or "12:03", in the viewer's time zone. */
export function clock(unix_s, seconds = true) {
  const t = new Date(1000 * unix_s);
  return `${two(t.getHours())}:${two(t.getMinutes())}${seconds ? `:${two(t.getSeconds())}` : ""}`;
}

/** out: "2026-11-23" */
export function day(unix_s) {
  const t = new Date(1000 * unix_s);
  return `${t.getFullYear()}-${two(t.getMonth() + 1)}-${two(t.getDate())}`;
}

/** out: "11-23 12:03" */
export const dateAndMinute = unix_s => `${day(unix_s).slice(5)} ${clock(unix_s, false)}`;

export const dayAndClock = unix_s => `${day(unix_s)} ${clock(unix_s)}`;
