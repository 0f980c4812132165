// SPDX-License-Identifier: MIT
// A card for each unit of the signals: their curves and a table. Temperatures come first.

import { Chart } from "./chart.js";
import { byId, element, remake, show } from "./element.js";
import { number, signalNumber, unitWord } from "./format.js";

const COLOURS = 8; // --line-1 …
const DASHES = [undefined, [8, 4], [2, 4], [8, 3, 2, 3]];
const TITLES = new Map([["degC", "Temperatures"], ["mm", "Positions"]]);

/** A line of the table: the swatch of its curve, name, value, age and state. */
class Row {
  constructor(name, line) {
    const swatch = element("i", { "aria-hidden": "true" });
    swatch.style.borderTop = `3px ${line.dash ? "dashed" : "solid"} var(${line.colour})`;
    this.value = element("td", { class: "numbers" });
    this.age = element("td", { class: "numbers age" });
    this.state = element("td", { class: "state" });
    this.root = element("tr", { "data-signal": name }, element("th", { scope: "row" }, swatch, name),
      this.value, this.age, this.state);
  }

  /** text: of the value at the cursor; null: the newest value */
  set(signal, text) {
    show(this.value, `${text ?? signalNumber(signal.value, signal.unit)} ${unitWord(signal.unit)}`);
    show(this.age, signal.age_ms === null ? "–" : `${number(signal.age_ms / 1000, 1)} s`);
    show(this.state, signal.state);
    this.state.dataset.state = signal.state;
  }
}

class Card {
  constructor({ unit, names }) {
    const title = TITLES.get(unit) ?? (unit ? `Signals in ${unitWord(unit)}` : "Signals without a unit");
    this.names = names;
    const lines = names.map((name, i) => ({
      label: name, colour: `--line-${i % COLOURS + 1}`, dash: DASHES[Math.floor(i / COLOURS) % DASHES.length],
    }));
    this.chart = new Chart(title, lines, value => signalNumber(value, unit));
    this.chart.probed = texts => {
      this.texts = texts;
      if (this.shown) this.set(this.shown);
    };
    this.rows = names.map((name, i) => new Row(name, lines[i]));
    this.root = element("article", { class: "card signals" }, element("h3", {}, title), this.chart.root,
      element("table", {}, element("thead", {}, element("tr", {},
        ...["signal", "value", "age", "state"].map(text => element("th", { scope: "col" }, text)))),
        element("tbody", {}, ...this.rows.map(row => row.root))));
  }

  set(signals) {
    this.shown = signals;
    this.rows.forEach((row, i) => row.set(signals.get(this.names[i]), this.texts?.[i]));
  }

  draw(columns, view) {
    const none = new Array(columns.unix_s.length).fill(null);
    this.chart.draw([columns.unix_s, ...this.names.map(name => columns.signals.get(name) ?? none)], view);
  }
}

/** out: [{unit, names}], temperatures first, then in the order of the file. */
function byUnit(signals) {
  const groups = new Map();
  for (const { name, unit } of signals) groups.set(unit, [...(groups.get(unit) ?? []), name]);
  return [...groups].map(([unit, names]) => ({ unit, names }))
    .sort((a, b) => Number(b.unit === "degC") - Number(a.unit === "degC"));
}

/** Shows the snapshot's signals. out: the cards. */
export function showSignals(snapshot) {
  const signals = new Map(snapshot.signals.map(signal => [signal.name, signal]));
  const made = remake(byId("signal-cards"), byUnit(snapshot.signals), group => new Card(group));
  for (const card of made) card.set(signals);
  return made;
}
