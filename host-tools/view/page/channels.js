// SPDX-License-Identifier: MIT
// A card for each channel: its output large, its curve, and the terms' shares of its demand.

import { Chart } from "./chart.js";
import { byId, element, remake, show } from "./element.js";
import { micrometres, number } from "./format.js";

const LINES = [
  { label: "applied", colour: "--applied", width: 5 },
  { label: "demand", colour: "--demand", width: 2, dash: [6, 4] },
  { label: "output", colour: "--output", width: 2 },
];

const STEPS = [1, 2, 5, 10];

/** out: the first of 1, 2, 5, 10, 20 … that is not below the value: a scale that seldom changes. */
function scaleFor(value) {
  const decade = 10 ** Math.floor(Math.log10(Math.max(value, 1)));
  return decade * STEPS.find(step => step * decade >= value - 1e-9);
}

/** A row of the shares: name, bar from the middle, value, remark. */
class Share {
  constructor(name, kind) {
    this.bar = element("div");
    this.value = element("td", { class: "numbers" });
    this.remark = element("small");
    this.root = element("tr", { class: kind }, element("th", { scope: "row" }, name, " ", this.remark),
      element("td", { class: "bar", "aria-hidden": "true" }, this.bar), this.value);
  }

  set(value_um, scale_um, remark = "") {
    const part = Math.min(Math.max((value_um ?? 0) / scale_um, -1), 1);
    this.bar.style.left = `${50 + 50 * Math.min(part, 0)}%`;
    this.bar.style.width = `${50 * Math.abs(part)}%`;
    show(this.value, micrometres(value_um));
    show(this.remark, remark);
  }
}

/** Why the output is what it is: each term's share, their sum, the limit, the output, what the PLC applies. */
class Shares {
  constructor(names) {
    this.terms = names.map(name => new Share(name, "term"));
    this.rest = new Share("faded out", "term");
    this.demand = new Share("demand", "sum");
    this.output = new Share("output", "output");
    this.applied = new Share("applied", "applied");
    this.summary = element("summary", { class: "numbers" });
    this.body = element("tbody", {}, ...this.terms.map(term => term.root), this.rest.root);
    this.root = element("details", {}, this.summary, element("table", { class: "shares" },
      this.body, element("tfoot", {}, this.demand.root, this.output.root, this.applied.root)));
    this.root.open = window.matchMedia("(min-width: 60rem)").matches;
  }

  set(channel, terms, mode) {
    const shares_um = channel.terms.map(name => -(terms.get(name) ?? 0));
    const rest_um = channel.demand_um - shares_um.reduce((sum, share) => sum + share, 0);
    const scale_um = scaleFor(Math.max(...[...shares_um, channel.demand_um, channel.output_um].map(Math.abs)));
    show(this.summary, `Why ${micrometres(channel.output_um)}?`);
    this.terms.forEach((term, i) => term.set(shares_um[i], scale_um));
    this.rest.root.hidden = !(Math.abs(rest_um) > 0.05);
    this.rest.set(rest_um, scale_um);
    this.demand.set(channel.demand_um, scale_um, "sum of the terms");
    this.output.set(channel.output_um, scale_um, outputRemark(channel, mode));
    this.applied.root.hidden = channel.applied_um === null;
    this.applied.set(channel.applied_um, scale_um, "by the PLC");
  }
}

/** out: why the output differs from the demand, as far as it does. */
function outputRemark(channel, mode) {
  if (mode !== "ACTIVE") return mode;
  if (Math.abs(channel.demand_um) > channel.limit_um) return `limited to ±${number(channel.limit_um, 0)} µm`;
  return channel.slewed ? "on its way" : "";
}

class Card {
  constructor({ name, terms }) {
    this.value = element("p", { class: "value numbers" });
    this.used = element("meter", { min: "0", max: "1", low: "0.75", high: "0.9", optimum: "0",
                                   "aria-label": `limit of ${name} used` });
    this.limit = element("span", { class: "numbers" });
    this.chart = new Chart(`Channel ${name}`, LINES, micrometres);
    this.shares = new Shares(terms);
    this.root = element("article", { class: "card channel", "data-channel": name },
      element("div", { class: "title" }, element("h3", {}, name), this.value),
      element("p", { class: "limit" }, this.used, this.limit), this.chart.root, this.shares.root);
  }

  set(channel, terms, mode) {
    show(this.value, micrometres(channel.output_um));
    this.used.value = channel.limit_used;
    show(this.limit, `${number(100 * channel.limit_used, 0)} % of ±${number(channel.limit_um, 0)} µm`);
    this.channel = channel;
    this.shares.set(channel, terms, mode);
  }

  draw(columns, view) {
    const none = new Array(columns.unix_s.length).fill(null);
    const { applied_um = none, demand_um = none, output_um = none, limit_um = none } =
      columns.channels.get(this.channel.name) ?? {};
    const limits = limit_um.some(limit => limit !== null) ? limit_um : [this.channel.limit_um]; // a record has none
    this.chart.draw([columns.unix_s, applied_um, demand_um, output_um],
      { ...view, limits, whole_um: view.limitsShown ? this.channel.limit_um : null });
  }
}

/** Shows the snapshot's channels. out: the cards. */
export function showChannels(snapshot) {
  const terms = new Map(snapshot.terms.map(term => [term.name, term.value]));
  const made = remake(byId("channel-cards"), snapshot.channels.map(({ name, terms }) => ({ name, terms })),
    one => new Card(one));
  made.forEach((card, i) => card.set(snapshot.channels[i], terms, snapshot.mode));
  return made;
}
