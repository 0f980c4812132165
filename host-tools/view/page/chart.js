// SPDX-License-Identifier: MIT
// A chart over time: uPlot with the page's colours, shaded limits and modes, and a cursor for mouse and keys.

import { element, show } from "./element.js";
import { clock, dateAndMinute, day } from "./format.js";

const LEAST_MARGIN = 0.5; // of a value that hardly changes, in its unit
const GONE = -10; // where uPlot shows no cursor

const token = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Labels of the time axis: a day where midnights are shown, else hours and minutes. */
const timeLabels = (plot, splits, axis, space, step_s) =>
  splits.map(unix_s => (step_s >= 86400 ? day(unix_s).slice(5) : clock(unix_s, step_s < 60)));

/** Fills the rectangle between two times and two values; null is the edge of the plot. */
function shade(plot, colour, [from_s, to_s], low = null, high = null) {
  const { left, top, width, height } = plot.bbox;
  const inside = (value, from, to) => Math.min(Math.max(value, from), to);
  const x0 = inside(plot.valToPos(from_s, "x", true), left, left + width);
  const x1 = inside(plot.valToPos(to_s, "x", true), left, left + width);
  const y0 = high === null ? top : inside(plot.valToPos(high, "y", true), top, top + height);
  const y1 = low === null ? top + height : inside(plot.valToPos(low, "y", true), top, top + height);
  plot.ctx.fillStyle = colour;
  plot.ctx.fillRect(x0, y0, x1 - x0, y1 - y0);
}

/** Calls what(value, [from_s, to_s]) for each run of equal values. widen: the outer runs have no end. */
function eachRun(times, column, widen, what) {
  const edge = (i, end_s) => (widen && (i === 0 || i >= column.length - 1) ? end_s : times[i]);
  for (let from = 0, i = 1; i <= column.length; i++) {
    if (i < column.length && column[i] === column[from]) continue;
    const to = Math.min(i, column.length - 1);
    if (column[from] != null) what(column[from], [edge(from, -Infinity), edge(to, Infinity)]);
    from = i;
  }
}

export class Chart {
  /** lines: [{label, colour (a CSS variable), width, dash}], the last one in front; format(value): text of a value. */
  constructor(label, lines, format) {
    this.lines = lines;
    this.format = format;
    this.data = [[], ...lines.map(() => [])];
    this.area = element("div", {
      class: "plot", tabindex: "0", role: "slider", "aria-label": `${label}: time`,
      "aria-valuemin": "0", "aria-valuemax": "0", "aria-valuenow": "0",
    });
    this.area.addEventListener("keydown", event => this.key(event));
    this.area.addEventListener("blur", () => this.plot?.setCursor({ left: GONE, top: GONE }));
    this.time = element("span", { class: "numbers time" });
    this.values = lines.map(() => element("span", { class: "numbers" }));
    this.root = element("figure", {}, this.area, element("figcaption", { class: "legend" }, this.time,
      ...lines.map((line, i) => this.legendOf(line, this.values[i])).reverse()));
    new ResizeObserver(() => this.resize()).observe(this.area);
  }

  legendOf(line, value) {
    const swatch = element("i", { "aria-hidden": "true" });
    swatch.style.borderTop = `${Math.min(line.width ?? 2, 5)}px ${line.dash ? "dashed" : "solid"} var(${line.colour})`;
    return element("span", { class: "line" }, swatch, line.label, " ", value);
  }

  size() {
    return { width: Math.max(this.area.clientWidth, 120), height: Math.max(this.area.clientHeight, 120) };
  }

  resize() {
    if (this.plot) this.plot.setSize(this.size());
  }

  /** Colours are read when the plot is made. */
  recolour() {
    this.plot?.destroy();
    this.plot = null;
  }

  make() {
    const axis = { stroke: token("--muted"), grid: { stroke: token("--grid"), width: 1 },
                   ticks: { stroke: token("--grid") }, font: "13px system-ui, sans-serif" };
    this.plot = new uPlot({
      ...this.size(),
      legend: { show: false },
      padding: [8, 12, 0, 0],
      cursor: { drag: { x: false, y: false }, points: { size: 6 }, sync: { key: "compbox" } },
      scales: {
        x: { time: true, range: () => this.range_s },
        y: { range: (plot, low, high) => this.range(low, high) },
      },
      series: [{}, ...this.lines.map(line => ({
        stroke: token(line.colour), width: line.width ?? 2, dash: line.dash, points: { show: false },
      }))],
      axes: [{ ...axis, values: timeLabels, space: 70, size: 32 }, { ...axis, size: 50 }],
      hooks: { drawClear: [plot => this.shadeAll(plot)], setCursor: [() => this.showValues()] },
    }, this.data, this.area);
  }

  shadeAll(plot) {
    plot.ctx.save();
    const limits = token("--limit-band"), modes = token("--mode-band");
    eachRun(this.data[0], this.modes ?? [], false, (mode, times) => {
      if (mode !== "ACTIVE") shade(plot, modes, times);
    });
    eachRun(this.data[0], this.limits ?? [], true, (limit_um, times) => {
      shade(plot, limits, times, limit_um, null);
      shade(plot, limits, times, null, -limit_um);
    });
    plot.ctx.restore();
  }

  /** in : the extremes of the curves, null without any. out: the range of the value axis. */
  range(low, high) {
    if (this.whole_um) {
      const edge_um = 1.15 * this.whole_um; // shows a part of the band beyond the limit
      return [Math.min(-edge_um, 1.05 * low), Math.max(edge_um, 1.05 * high)];
    }
    if (low === null || high === null) return [0, 1];
    const margin = Math.max(0.1 * (high - low), LEAST_MARGIN);
    return [low - margin, high + margin];
  }

  /**
   * in : data: times, then a column for each line; view: {range_s, modes, limits, whole_um: the limit that must be in
   * sight, or null}
   */
  draw(data, view) {
    Object.assign(this, view);
    this.data = data;
    if (!this.plot) this.make();
    this.plot.setData(data);
    this.area.setAttribute("aria-valuemax", String(Math.max(data[0].length - 1, 0)));
    this.showValues();
  }

  /** The values at the cursor, or the newest ones. */
  showValues() {
    if (!this.plot) return;
    const last = this.data[0].length - 1;
    const probed = this.plot.cursor.idx;
    const at = probed ?? last;
    const unix_s = this.data[0][at];
    const texts = this.lines.map((line, i) => this.format(this.data[i + 1][at]));
    const words = this.range_s[1] - this.range_s[0] < 3600 ? clock : dateAndMinute;
    show(this.time, unix_s === undefined ? "" : words(unix_s));
    this.probed?.(probed === null || probed === undefined ? null : texts);
    texts.forEach((text, i) => show(this.values[i], text));
    this.area.setAttribute("aria-valuenow", String(Math.max(at, 0)));
    this.area.setAttribute("aria-valuetext",
      [this.time.textContent, ...this.lines.map((line, i) => `${line.label} ${texts[i]}`)].join(", "));
  }

  /** Arrows move the cursor by a fiftieth of the width, Home and End to the edges, Escape removes it. */
  key(event) {
    const width = this.plot?.over.clientWidth ?? 0;
    const left = this.plot?.cursor.left >= 0 ? this.plot.cursor.left : width;
    const step = width / 50;
    const to = { ArrowLeft: left - step, ArrowRight: left + step, Home: 0, End: width, Escape: GONE }[event.key];
    if (to === undefined || !this.plot) return;
    event.preventDefault();
    this.plot.setCursor({ left: to === GONE ? GONE : Math.min(Math.max(to, 0), width - 1), top: 1 });
  }
}
